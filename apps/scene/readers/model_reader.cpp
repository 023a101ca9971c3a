#include <glm/trigonometric.hpp>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"

namespace groundray::yaml {
namespace {

AssetSpec read_asset(Map& entry, const Node& name, Faults& faults) {
  AssetSpec asset;
  if (!is_text(name, "asset", faults)) return asset;
  const std::size_t before = faults.count();
  try {
    asset.kind = asset_kind(name.text);
  } catch (const Error& fault) {
    faults.add(name, "asset", "{}", fault.what());
  }
  entry.read_number("size_m", Need::Optional, asset.size_m, positive);
  entry.read_number("width_m", Need::Optional, asset.width_m, positive);
  entry.read_number("sag_m", Need::Optional, asset.sag_m, positive);
  entry.read_number("per_m2", Need::Optional, asset.per_m2, positive);
  entry.read_number("square_m", Need::Optional, asset.square_m, positive);
  entry.read_number("leaf_area_index", Need::Optional, asset.leaf_area_index, positive);
  entry.read_choice("leaves", Need::Optional, asset.leaves, {"cards", "geometry"});
  entry.read_number("health", Need::Optional, asset.health, share_rule);
  entry.read_whole("variant", Need::Optional, asset.seed.value);
  entry.read_number("detail", Need::Optional, asset.detail, positive);
  if (faults.count() > before) return asset;
  try {
    check_asset(asset);
  } catch (const Error& fault) {
    faults.add(name, "asset", "it cannot be generated:\n{}", fault.what());
  }
  return asset;
}

DisplacementSource read_displacement(Map map, const fs::path& path) {
  DisplacementSource displacement;
  read_path(map, "image", Need::Required, path, displacement.image);
  map.read_number("amplitude_m", Need::Required, displacement.amplitude_m, positive);
  map.read_number("middle", Need::Optional, displacement.middle);
  map.read_number("cell_m", Need::Required, displacement.cell_m, positive);
  map.close();
  return displacement;
}

ModelSource read_file_source(Map& entry, const Node& file, const fs::path& path, Faults& faults) {
  ModelSource source;
  if (is_text(file, "model", faults)) source.file = beside(path, file.text);
  entry.read_number("metres_per_unit", Need::Optional, source.options.metres_per_unit, positive);
  UpAxis up = UpAxis::Z;
  if (entry.read_choice("up", Need::Optional, up, {"x", "y", "z"})) source.options.up = up;
  entry.read_choice("broken", Need::Optional, source.options.broken, {"refuse", "drop"});
  if (auto map = entry.map("displacement", Need::Optional))
    source.displacement = read_displacement(std::move(*map), path);
  return source;
}

Flexibility read_sway(Map map) {
  constexpr Rule frequency_rule{[](double value) { return value >= 0.01 && value <= 100; },
                                "must be from 0.01 to 100"};
  constexpr Rule lean_rule{[](double value) { return value >= 0 && value <= 45; },
                           "must be from 0 to 45"};
  Flexibility plant;
  double lean_deg = 0;
  map.read_number("frequency_hz", Need::Required, plant.frequency_hz, frequency_rule);
  map.read_number("lean_deg", Need::Required, lean_deg, lean_rule);
  map.close();
  plant.lean_rad = glm::radians(lean_deg);
  return plant;
}

}  // namespace

ModelSpec read_model_spec(Map& entry, const fs::path& path, const DataFolders& folders,
                          Faults& faults) {
  ModelSpec spec;
  const Node* const asset = entry.find("asset", Need::Optional);
  const Node* const file = entry.find("model", Need::Optional);
  if ((asset == nullptr) == (file == nullptr) && entry.node().kind == Node::Kind::Map)
    faults.add(entry.node(), "model", "there must be exactly one of 'asset' and 'model'");
  if (asset != nullptr) {
    spec.source = read_asset(entry, *asset, faults);
  } else if (file != nullptr) {
    spec.source = read_file_source(entry, *file, path, faults);
  }
  if (auto map = entry.map("sway", Need::Optional)) spec.sway = read_sway(std::move(*map));
  if (const Node* const node = entry.find("material", Need::Optional))
    spec.material = read_material(*node, "material", path, folders, faults);
  const Node* const materials = entry.find("materials", Need::Optional);
  if (materials == nullptr) return spec;
  const Map names(*materials, "materials", faults);
  if (materials->kind != Node::Kind::Map) return spec;
  for (std::size_t i = 0; i + 1 < materials->items.size(); i += 2) {
    const std::string& surface = materials->items[i].text;
    if (auto material = read_material(materials->items[i + 1], surface, path, folders, faults))
      spec.materials.emplace(surface, std::move(*material));
  }
  return spec;
}

void read_stance(Map& entry, Stance& stance) {
  entry.read_choice("stance", Need::Optional, stance, {"upright", "on_slope"});
}

}  // namespace groundray::yaml
