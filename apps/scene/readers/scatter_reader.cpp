#include <algorithm>
#include <cstdint>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"

namespace groundray::yaml {
namespace {

// Common arguments of the readers below.
struct Reading {
  const fs::path& path;
  const DataFolders& folders;
  std::span<const TrailSpec> trails;
  Faults& faults;
  bool has_water = false;  // of the terrain
};

constexpr std::uint32_t most_variants = 16;
constexpr Rule weibull_shape_rule{[](double value) { return value >= 0.2 && value <= 20; },
                                  "must be from 0.2 to 20"};

Clearing read_clearing(Map entry, Faults& faults) {
  Clearing clearing;
  const bool is_line = entry.find("line_m", Need::Optional) != nullptr;
  const std::string_view key = is_line ? "line_m" : "polygon_m";
  if (!is_line) clearing.shape = Clearing::Shape::Polygon;
  clearing.points_D = read_points(entry.list(key, Need::Required), key, faults);
  entry.read_number("half_width_m", is_line ? Need::Required : Need::Optional,
                    clearing.half_width_m, not_negative);
  entry.close();
  return clearing;
}

ClearedTrail read_cleared_trail(Map entry, const Reading& with) {
  ClearedTrail cleared;
  if (const TrailSpec* const trail = find_trail(entry, "trail", with.trails, with.faults))
    cleared.name = trail->name;
  entry.read_number("half_width_m", Need::Required, cleared.half_width_m, not_negative);
  entry.close();
  return cleared;
}

void read_models(Map& entry, ScatterLayer& layer, const Reading& with) {
  layer.scatter.weights.clear();
  for (const Node& node : entry.list("models", Need::Required)) {
    Map model(node, "models", with.faults);
    double weight = 1;
    model.read_number("weight", Need::Optional, weight, positive);
    layer.models.push_back(read_model_spec(model, with.path, with.folders, with.faults));
    layer.scatter.weights.push_back(weight);
    model.close();
  }
  const Node* const list = entry.find("models", Need::Optional);
  if (list != nullptr && list->kind == Node::Kind::List && layer.models.empty())
    with.faults.add(*list, "models", "is an empty list, but a layer needs at least one");
}

Rows read_rows(Map entry) {
  Rows rows;
  glm::dvec2 spacing_m(rows.between_m, rows.within_m);
  entry.read_vector("spacing_m", Need::Required, spacing_m, positive);
  rows.between_m = spacing_m.x;
  rows.within_m = spacing_m.y;
  entry.read_number("azimuth_deg", Need::Optional, rows.azimuth_deg);
  entry.read_number("jitter_m", Need::Optional, rows.jitter_m, not_negative);
  entry.close();
  return rows;
}

Clusters read_clusters(Map entry) {
  Clusters clusters;
  entry.read_number("size_m", Need::Required, clusters.size_m, positive);
  entry.read_number("contrast", Need::Optional, clusters.contrast, share_rule);
  entry.close();
  return clusters;
}

// Reads the keys that layers of `scatter` and species of an ecosystem have in common.
void read_growth(Map& entry, ScatterLayer& layer, const Reading& with) {
  entry.read_text("name", Need::Required, layer.name);
  entry.read_whole("label", Need::Required, layer.label);
  ScatterSpec& scatter = layer.scatter;
  if (auto rows = entry.map("rows", Need::Optional)) {
    scatter.rows = read_rows(*std::move(rows));
    layer.density_per_m2 = 1 / (scatter.rows->between_m * scatter.rows->within_m);
  }
  entry.read_number("density_per_m2", scatter.rows ? Need::Optional : Need::Required,
                    layer.density_per_m2, not_negative);
  read_path(entry, "density_map", Need::Optional, with.path, layer.density_map);
  entry.read_number("nodata", Need::Optional, layer.nodata, any_number);
  read_interval(entry, "slope_deg", scatter.slope_deg, slope_rule, with.faults);
  read_interval(entry, "height_m", scatter.height_m, any_number, with.faults);
  layer.site = read_site(entry, with.trails, with.faults);
  if (layer.site.water && !with.has_water)
    with.faults.add(entry.node(), "water",
                    "needs terrain.water with the size of its cells, such as water: {{cell_m: "
                    "0.5}}");
  read_interval(entry, "yaw_deg", scatter.yaw_deg, any_number, with.faults);
  read_stance(entry, scatter.stance);
  if (const Node* const corners = entry.find("area_m", Need::Optional)) {
    const auto area_m = read_points(entry.list("area_m", Need::Optional), "area_m", with.faults);
    if (area_m.size() != 2)
      with.faults.add(*corners, "area_m", "must be [[west, south], [east, north]]");
    else if (layer.area_W = {area_m[0], area_m[1]}; layer.area_W.is_empty())
      with.faults.add(*corners, "area_m",
                      "is empty: the first corner must be the south-western one");
  }
  for (const Node& node : entry.list("clearings", Need::Optional)) {
    Map clearing(node, "clearings", with.faults);
    if (clearing.find("trail", Need::Optional) != nullptr)
      layer.trails.push_back(read_cleared_trail(std::move(clearing), with));
    else
      scatter.clearings.push_back(read_clearing(std::move(clearing), with.faults));
  }
}

ScatterLayer read_scatter_layer(Map entry, const Reading& with) {
  ScatterLayer layer;
  read_growth(entry, layer, with);
  read_models(entry, layer, with);
  ScatterSpec& scatter = layer.scatter;
  entry.read_number("min_distance_m", Need::Optional, scatter.min_distance_m, not_negative);
  read_interval(entry, "scale", scatter.scale, positive, with.faults);
  entry.read_number("sink_m", Need::Optional, scatter.sink_m);
  if (auto clusters = entry.map("clusters", Need::Optional)) {
    scatter.clusters = read_clusters(*std::move(clusters));
    if (scatter.rows)
      with.faults.add(*entry.find("clusters", Need::Optional), "clusters",
                      "have no meaning in 'rows', whose sites are given: remove one of them, or "
                      "make gaps with 'density_map'");
  }
  entry.close();
  return layer;
}

// Reads the heights of a species' plants.
void read_sizes(Map& entry, ScatterSpec& scatter, Faults& faults) {
  entry.find("sizes_m", Need::Required);
  read_interval(entry, "sizes_m", scatter.scale, positive, faults);
  Weibull& sizes = scatter.scales.emplace();
  sizes.scale = std::max((scatter.scale.high - scatter.scale.low) / 2, 0.01);
  if (auto weibull = entry.map("weibull", Need::Optional)) {
    weibull->read_number("shape", Need::Optional, sizes.shape, weibull_shape_rule);
    weibull->read_number("scale_m", Need::Optional, sizes.scale, positive);
    weibull->close();
  }
}

// Reads the models of a species: of an asset, several variants of different sizes.
void read_variants(Map& entry, ScatterLayer& layer, const Reading& with) {
  ModelSpec model = read_model_spec(entry, with.path, with.folders, with.faults);
  std::uint32_t variants = 3;
  const Node* const given = entry.read_whole("variants", Need::Optional, variants);
  if (given != nullptr && (variants < 1 || variants > most_variants))
    with.faults.add(*given, "variants", "is {}, but must be from 1 to {}", variants, most_variants);
  const auto* const asset = std::get_if<AssetSpec>(&model.source);
  if (asset == nullptr || entry.find("model", Need::Optional) != nullptr) {
    if (given != nullptr)
      with.faults.add(*given, "variants", "applies to 'asset', which is missing");
    layer.models.push_back(std::move(model));
    return;
  }
  if (asset->size_m)
    with.faults.add(*entry.find("size_m", Need::Optional), "size_m",
                    "follows from 'sizes_m' in an ecosystem: remove it");
  for (std::uint32_t i = 0; i < std::min(variants, most_variants); ++i) {
    AssetSpec variant = *asset;
    variant.size_m = layer.scatter.scales->quantile((i + 0.5) / variants, layer.scatter.scale);
    variant.seed.value += i;
    layer.models.push_back(model);
    layer.models.back().source = variant;
  }
}

ScatterLayer read_species(Map entry, const Reading& with) {
  ScatterLayer layer;
  read_growth(entry, layer, with);
  read_sizes(entry, layer.scatter, with.faults);
  read_variants(entry, layer, with);
  SpeciesSpec& species = layer.species.emplace();
  entry.read_number("zone", Need::Optional, species.zone, not_negative);
  entry.read_number("tolerance", Need::Optional, species.tolerance, share_rule);
  entry.read_number("min_distance_m", Need::Optional, species.min_distance_m, not_negative);
  entry.close();
  return layer;
}

// FNV-1a hash of a layer's name. It is the layer's key among random numbers, so that its plants do
// not depend on the other layers.
// @see http://www.isthe.com/chongo/tech/comp/fnv
std::uint32_t hash_of(std::string_view name) {
  std::uint32_t hash = 0x811c9dc5;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x01000193;
  return hash;
}

}  // namespace

std::vector<ScatterLayer> read_scatter(Map& root, const fs::path& path, const DataFolders& folders,
                                       const TerrainSpec& terrain, Faults& faults) {
  const auto trails = terrain.relief ? std::span<const TrailSpec>(terrain.relief->trails)
                                     : std::span<const TrailSpec>();
  const Reading with{path, folders, trails, faults, terrain.water.has_value()};
  std::vector<ScatterLayer> layers;
  UniqueNames names("layer", faults);
  const auto add = [&](const Node& node, ScatterLayer layer) {
    layer.where = faults.place(node);
    layer.scatter.layer = hash_of(layer.name);
    names.add(node, layer.name);
    for (const ScatterLayer& other : layers) {
      if (other.scatter.layer == layer.scatter.layer && other.name != layer.name) {
        faults.add(
            node, "name",
            "'{}' has the same hash as '{}', so their random positions would be equal: rename one",
            layer.name, other.name);
      }
    }
    layers.push_back(std::move(layer));
  };
  for (const Node& node : root.list("scatter", Need::Optional))
    add(node, read_scatter_layer(Map(node, "scatter", faults), with));
  for (const Node& node : root.list("ecosystem", Need::Optional))
    add(node, read_species(Map(node, "ecosystem", faults), with));
  return layers;
}

}  // namespace groundray::yaml
