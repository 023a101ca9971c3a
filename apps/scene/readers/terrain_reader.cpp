#include <glm/trigonometric.hpp>
#include <limits>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"
#include "core/image/image_io.h"

namespace groundray::yaml {
namespace {

ImageRelief read_image_relief(Map map, const fs::path& path, Faults& faults) {
  ImageRelief relief;
  std::string file;
  if (const Node* const at = map.read_text("file", Need::Required, file)) {
    try {
      relief.image = read_heights(beside(path, file));
    } catch (const Error& fault) {
      faults.add(*at, "file", "the image cannot be read:\n{}", fault.what());
    }
  }
  map.read_number("amplitude_m", Need::Required, relief.amplitude_m);
  map.read_number("middle", Need::Optional, relief.middle);
  map.read_number("size_m", Need::Required, relief.size_m, positive);
  map.close();
  return relief;
}

FractalSpec read_fractal(Map map) {
  FractalSpec fractal;
  map.read_number("rms_m", Need::Required, fractal.rms_m, positive);
  map.read_number("hurst", Need::Optional, fractal.hurst, share_rule);
  map.read_number("shortest_m", Need::Required, fractal.shortest_m, positive);
  map.read_number("longest_m", Need::Required, fractal.longest_m, positive);
  map.read_whole("variant", Need::Optional, fractal.seed.value);
  map.close();
  return fractal;
}

ReliefSpec read_relief(Map map, const fs::path& path, Faults& faults) {
  ReliefSpec relief;
  map.read_number("cell_m", Need::Required, relief.cell_m, positive);
  map.read_number("period_m", Need::Optional, relief.period_m, positive);
  if (auto image = map.map("image", Need::Optional))
    relief.image = read_image_relief(std::move(*image), path, faults);
  if (auto fractal = map.map("fractal", Need::Optional))
    relief.fractal = read_fractal(std::move(*fractal));
  if (!relief.image && !relief.fractal && map.node().kind == Node::Kind::Map)
    faults.add(map.node(), "relief", "must have 'image' or 'fractal', or both");
  map.close();
  return relief;
}

// Reads images that repeat over the ground.
std::optional<GroundTextureSpec> read_ground_texture(Map& map, const fs::path& path,
                                                     Faults& faults) {
  auto texture = map.map("texture", Need::Optional);
  if (!texture) return std::nullopt;
  GroundTextureSpec spec;
  read_path(*texture, "albedo", Need::Optional, path, spec.albedo);
  read_path(*texture, "normal", Need::Optional, path, spec.normal);
  if (spec.albedo.empty() && spec.normal.empty() && texture->node().kind == Node::Kind::Map)
    faults.add(texture->node(), "texture", "must have 'albedo' or 'normal', or both");
  texture->read_number("size_m", Need::Required, spec.size_m, positive);
  texture->close();
  return spec;
}

// Reads limits [low, high] at `key`, and the width of their ramps at `blend_key`.
CoverLimits read_limits(Map& entry, std::string_view key, std::string_view blend_key, Rule rule,
                        Faults& faults) {
  CoverLimits limits;
  Interval ends{limits.low, limits.high};
  read_interval(entry, key, ends, rule, faults);
  limits.low = ends.low;
  limits.high = ends.high;
  const Node* const blend =
      entry.read_number(blend_key, Need::Optional, limits.blend, not_negative);
  if (blend != nullptr && entry.find(key, Need::Optional) == nullptr)
    faults.add(*blend, blend_key, "applies to '{}', which is missing", key);
  return limits;
}

void read_mask(Map& entry, const fs::path& path, CoverSpec& spec, Faults& faults) {
  read_path(entry, "mask", Need::Optional, path, spec.mask);
  const Node* const full = entry.read_number("mask_full", Need::Optional, spec.mask_full, positive);
  const Node* const none = entry.read_number("mask_nodata", Need::Optional, spec.mask_nodata);
  if (!spec.mask.empty() || entry.find("mask", Need::Optional) != nullptr) return;
  if (full != nullptr) faults.add(*full, "mask_full", "applies to 'mask', which is missing");
  if (none != nullptr) faults.add(*none, "mask_nodata", "applies to 'mask', which is missing");
}

CoverSpec read_cover_layer(const Node& node, const fs::path& path, const DataFolders& folders,
                           Faults& faults) {
  Map entry(node, "cover", faults);
  CoverSpec spec;
  if (const Node* const material = entry.find("material", Need::Required))
    spec.material = read_material(*material, "material", path, folders, faults);
  std::uint16_t label = 0;
  if (entry.read_whole("label", Need::Optional, label)) spec.label = label;
  spec.slope_rad = read_limits(entry, "slope_deg", "slope_blend_deg", slope_rule, faults);
  for (double* angle : {&spec.slope_rad.low, &spec.slope_rad.high, &spec.slope_rad.blend})
    *angle = glm::radians(*angle);
  // No slope exceeds these, so they are no limits and have no ramp.
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (spec.slope_rad.low == 0) spec.slope_rad.low = -infinity;
  if (spec.slope_rad.high == glm::radians(90.0)) spec.slope_rad.high = infinity;
  spec.height_m = read_limits(entry, "height_m", "height_blend_m", any_number, faults);
  read_mask(entry, path, spec, faults);
  spec.texture = read_ground_texture(entry, path, faults);
  entry.close();
  return spec;
}

std::vector<CoverSpec> read_cover(Map& terrain, const fs::path& path, const DataFolders& folders,
                                  Faults& faults) {
  std::vector<CoverSpec> layers;
  for (const Node& entry : terrain.list("cover", Need::Optional))
    layers.push_back(read_cover_layer(entry, path, folders, faults));
  constexpr std::size_t most = GroundCover::most_layers - 1;  // one is the terrain's own
  if (layers.size() > most) {
    faults.add(*terrain.find("cover", Need::Optional), "cover",
               "has {} layers, but must have at most {}", layers.size(), most);
  }
  return layers;
}

}  // namespace

void read_interval(Map& entry, std::string_view key, Interval& interval, Rule rule,
                   Faults& faults) {
  glm::dvec2 ends(interval.low, interval.high);
  const Node* const at = entry.read_vector(key, Need::Optional, ends, rule);
  if (at != nullptr && ends.x > ends.y)
    faults.add(*at, key, "[{}, {}] is empty: are its ends swapped?", ends.x, ends.y);
  interval = {ends.x, ends.y};
}

TerrainSpec read_terrain(Map terrain, const fs::path& path, const DataFolders& folders,
                         Faults& faults) {
  TerrainSpec spec;
  if (const Node* const node = terrain.find("material", Need::Optional))
    spec.material = read_material(*node, "material", path, folders, faults);
  if (auto relief = terrain.map("relief", Need::Optional))
    spec.relief = read_relief(std::move(*relief), path, faults);
  spec.texture = read_ground_texture(terrain, path, faults);
  spec.cover = read_cover(terrain, path, folders, faults);
  read_path(terrain, "orthophoto", Need::Optional, path, spec.orthophoto);
  if (const Node* const dem = read_path(terrain, "dem", Need::Required, path, spec.dem))
    spec.where = faults.place(*dem);
  terrain.read_number("nodata", Need::Optional, spec.options.nodata);
  terrain.read_text("reproject_to", Need::Optional, spec.options.reproject_to);
  terrain.read_whole("label", Need::Optional, spec.label);
  terrain.read_number("tolerance_m", Need::Optional, spec.detail.tolerance_m, not_negative);
  double tolerance_mrad = 0;
  terrain.read_number("tolerance_mrad", Need::Optional, tolerance_mrad, not_negative);
  spec.detail.tolerance_rad = tolerance_mrad / 1000;
  if (const Node* at = terrain.read_whole("memory_mib", Need::Optional, spec.detail.memory_mib);
      at && spec.detail.memory_mib == 0) {
    faults.add(*at, "memory_mib", "is 0, but must be at least 1");
  }
  terrain.close();
  return spec;
}

}  // namespace groundray::yaml
