#include <algorithm>
#include <cstdint>
#include <glm/trigonometric.hpp>
#include <limits>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "terrain/textures/ground_images.h"

namespace groundray::yaml {
namespace {

// Returns relief of the heights of generated ground, with values from 0 to 1.
ImageRelief relief_of(const GroundImageSpec& spec) {
  ImageRelief relief{make_ground_images(spec).height_m, 0, 0, spec.size_m};
  const auto values = relief.image.values();
  const auto [low, high] = std::ranges::minmax(values);
  relief.amplitude_m = static_cast<double>(high - low);
  relief.middle = static_cast<double>(-low / (high - low));
  for (float& value : values) value = (value - low) / (high - low);
  return relief;
}

ImageRelief read_image_relief(Map map, const fs::path& path,
                              std::optional<GroundImageSpec>& generated, Faults& faults) {
  ImageRelief relief;
  if (map.find("generate", Need::Optional) != nullptr) {
    if (const auto spec = read_ground_image(map, faults)) {
      generated = spec;
      relief = relief_of(*spec);
    }
    map.read_number("amplitude_m", Need::Optional, relief.amplitude_m);
  } else {
    std::string file;
    if (const Node* const at = map.read_text("file", Need::Required, file)) {
      try {
        relief.image = read_heights(beside(path, file));
      } catch (const Error& fault) {
        faults.add(*at, "file", "the image cannot be read:\n{}", fault.what());
      }
    }
    map.read_number("amplitude_m", Need::Required, relief.amplitude_m);
    map.read_number("size_m", Need::Required, relief.size_m, positive);
  }
  map.read_number("middle", Need::Optional, relief.middle);
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

ReliefSpec read_relief(Map map, const fs::path& path, std::optional<GroundImageSpec>& generated,
                       Faults& faults) {
  ReliefSpec relief;
  map.read_number("cell_m", Need::Required, relief.cell_m, positive);
  map.read_number("period_m", Need::Optional, relief.period_m, positive);
  if (auto image = map.map("image", Need::Optional))
    relief.image = read_image_relief(std::move(*image), path, generated, faults);
  if (auto fractal = map.map("fractal", Need::Optional))
    relief.fractal = read_fractal(std::move(*fractal));
  map.close();
  return relief;
}

constexpr Rule talus_rule{[](double value) { return value >= 5 && value <= 80; },
                          "must be from 5 to 80"};
constexpr Rule area_exponent_rule{[](double value) { return value >= 0 && value <= 2; },
                                  "must be from 0 to 2"};
constexpr Rule slope_exponent_rule{[](double value) { return value >= 0.25 && value <= 4; },
                                   "must be from 0.25 to 4"};

constexpr Rule uplift_rule{[](double value) { return value >= 0 && value <= 0.1; },
                           "must be from 0 to 0.1 (metres)"};

StreamPower read_streams(Map map, Faults& faults) {
  StreamPower law;
  map.read_number("years", Need::Required, law.years, positive);
  map.read_number("erodibility", Need::Required, law.erodibility, not_negative);
  map.read_number("area_exponent", Need::Optional, law.area_exponent, area_exponent_rule);
  map.read_number("slope_exponent", Need::Optional, law.slope_exponent, slope_exponent_rule);
  map.read_number("uplift_m_yr", Need::Optional, law.uplift_m_yr, uplift_rule);
  std::uint16_t steps = static_cast<std::uint16_t>(law.steps);
  if (const Node* const at = map.read_whole("steps", Need::Optional, steps); at && steps == 0)
    faults.add(*at, "steps", "is 0, but must be at least 1");
  law.steps = std::max<int>(steps, 1);
  map.close();
  return law;
}

ErosionSpec read_erosion(Map map, Faults& faults) {
  ErosionSpec erosion;
  double talus_deg = 0;
  if (map.read_number("talus_deg", Need::Optional, talus_deg, talus_rule) != nullptr)
    erosion.talus_rad = glm::radians(talus_deg);
  if (auto streams = map.map("streams", Need::Optional))
    erosion.streams = read_streams(std::move(*streams), faults);
  if (map.node().kind == Node::Kind::Map && map.find("talus_deg", Need::Optional) == nullptr &&
      map.find("streams", Need::Optional) == nullptr)
    faults.add(map.node(), "erosion", "must have 'talus_deg' or 'streams', or both");
  map.close();
  return erosion;
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
                           std::span<const TrailSpec> trails, Faults& faults) {
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
  spec.site = read_site(entry, trails, faults);
  spec.texture = read_ground_texture(entry, path, faults);
  entry.close();
  return spec;
}

std::vector<CoverSpec> read_cover(Map& terrain, const fs::path& path, const DataFolders& folders,
                                  std::span<const TrailSpec> trails, Faults& faults) {
  std::vector<CoverSpec> layers;
  for (const Node& entry : terrain.list("cover", Need::Optional))
    layers.push_back(read_cover_layer(entry, path, folders, trails, faults));
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
  if (auto erosion = terrain.map("erosion", Need::Optional))
    spec.erosion = read_erosion(std::move(*erosion), faults);
  if (auto relief = terrain.map("relief", Need::Optional))
    spec.relief = read_relief(std::move(*relief), path, spec.relief_ground, faults);
  std::vector<TrailSpec> trails = read_trails(terrain, faults);
  if (const Node* const at = terrain.find("relief", Need::Optional);
      at != nullptr && spec.relief && trails.empty() && !spec.relief->image &&
      !spec.relief->fractal && at->kind == Node::Kind::Map)
    faults.add(*at, "relief", "must have 'image' or 'fractal', or both, unless there are trails");
  if (const Node* const at = terrain.find("trails", Need::Optional);
      at != nullptr && !trails.empty() && !spec.relief) {
    faults.add(*at, "trails", "need 'relief' with the size of its cells, such as {{cell_m: 0.1}}");
    spec.relief.emplace();  // so that names of trails are found
  }
  if (spec.relief) spec.relief->trails = std::move(trails);
  spec.texture = read_ground_texture(terrain, path, faults);
  spec.cover = read_cover(
      terrain, path, folders,
      spec.relief ? std::span<const TrailSpec>(spec.relief->trails) : std::span<const TrailSpec>(),
      faults);
  if (auto water = terrain.map("water", Need::Optional)) {
    WaterGrid& grid = spec.water.emplace();
    water->read_number("cell_m", Need::Required, grid.cell_m, positive);
    water->read_number("most_m", Need::Optional, grid.most_m, positive);
    water->close();
  }
  const bool needs_water = std::ranges::any_of(
      spec.cover, [](const CoverSpec& layer) { return layer.site.water.has_value(); });
  if (needs_water && terrain.find("water", Need::Optional) == nullptr)
    faults.add(terrain.node(), "terrain",
               "a cover layer with 'water' needs 'water' with the size of its cells, such as "
               "water: {{cell_m: 0.5}}");
  if (auto canopy = terrain.map("canopy", Need::Optional)) {
    canopy->read_number("cell_m", Need::Optional, spec.canopy.cell_m, positive);
    canopy->read_number("radius_m", Need::Optional, spec.canopy.radius_m, positive);
    canopy->close();
  }
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
