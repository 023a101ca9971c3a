#include "apps/scene/readers/cover_reader.h"

#include <glm/trigonometric.hpp>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "apps/scene/readers/interval_reader.h"
#include "apps/scene/readers/pattern_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::any_number;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::not_negative;
using yaml::positive;
using yaml::Rule;

// Reads limits [low, high] at `key`, and the width of their ramps at `blend_key`.
CoverLimits read_limits(Map& entry, std::string_view key, std::string_view blend_key, Rule rule,
                        Faults& faults) {
  CoverLimits limits;
  const Interval ends = read_interval(entry, key, {limits.low, limits.high}, rule, faults);
  limits.low = ends.low;
  limits.high = ends.high;
  const Node* const blend =
      entry.read_number(blend_key, Need::Optional, limits.blend, not_negative);
  if (blend != nullptr && entry.find(key, Need::Optional) == nullptr)
    faults.add(*blend, blend_key, "applies to '{}', which is missing", key);
  return limits;
}

void read_mask(Map& entry, const fs::path& path, CoverSpec& spec, Faults& faults) {
  std::string mask;
  if (entry.read_text("mask", Need::Optional, mask)) spec.mask = beside(path, mask);
  const Node* const full = entry.read_number("mask_full", Need::Optional, spec.mask_full, positive);
  double nodata = 0;
  const Node* const none = entry.read_number("mask_nodata", Need::Optional, nodata);
  if (none != nullptr) spec.mask_nodata = nodata;
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

}  // namespace

std::optional<GroundTextureSpec> read_ground_texture(Map& map, const fs::path& path,
                                                     Faults& faults) {
  auto texture = map.map("texture", Need::Optional);
  if (!texture) return std::nullopt;
  GroundTextureSpec spec;
  std::string file;
  if (texture->read_text("albedo", Need::Optional, file)) spec.albedo = beside(path, file);
  if (texture->read_text("normal", Need::Optional, file)) spec.normal = beside(path, file);
  if (spec.albedo.empty() && spec.normal.empty() && texture->node().kind == Node::Kind::Map)
    faults.add(texture->node(), "texture", "must have 'albedo' or 'normal', or both");
  texture->read_number("size_m", Need::Required, spec.size_m, positive);
  texture->close();
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

}  // namespace groundray
