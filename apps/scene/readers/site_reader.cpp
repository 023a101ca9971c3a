#include <algorithm>
#include <limits>
#include <utility>

#include "apps/scene/readers/readers.h"

namespace groundray::yaml {
namespace {

// Reads a distance from trails.
SiteConditions::BesideTrail read_beside_trail(Map map, std::span<const TrailSpec> trails,
                                              Faults& faults) {
  using From = SiteConditions::BesideTrail::From;
  SiteConditions::BesideTrail beside;
  const TrailSpec* const only = find_trail(map, "name", trails, faults);
  if (only != nullptr) beside.name = only->name;
  const bool from_ruts = map.find("ruts_m", Need::Optional) != nullptr;
  if (from_ruts == (map.find("edge_m", Need::Optional) != nullptr))
    faults.add(map.node(), "trail", "must have exactly one of 'edge_m' and 'ruts_m'");
  beside.from = from_ruts ? From::Ruts : From::Edge;
  const std::string_view key = from_ruts ? "ruts_m" : "edge_m";
  beside.limits_m = read_limits(map, key, "blend_m", any_number, faults);
  const auto has_ruts = [](const TrailSpec& trail) { return trail.ruts.has_value(); };
  const bool is_some = only != nullptr ? has_ruts(*only) : std::ranges::any_of(trails, has_ruts);
  if (trails.empty())
    faults.add(map.node(), "trail", "there are no trails under terrain.trails");
  else if (from_ruts && !is_some)
    faults.add(map.node(), "ruts_m", "no trail that it applies to has 'ruts'");
  map.close();
  return beside;
}

// Reads a condition on water.
SiteConditions::Water read_water(Map map, Faults& faults) {
  using Quantity = SiteConditions::Water::Quantity;
  SiteConditions::Water water;
  int given = 0;
  const auto read = [&](std::string_view key, std::string_view blend_key, Quantity quantity) {
    if (map.find(key, Need::Optional) == nullptr) return;
    water = {quantity, read_limits(map, key, blend_key, any_number, faults)};
    ++given;
  };
  read("depth_m", "blend_m", Quantity::Depth);
  read("wetness", "blend", Quantity::Wetness);
  read("distance_m", "blend_m", Quantity::Distance);
  // No distance is less, so this is no limit and has no ramp.
  if (water.quantity == Quantity::Distance && water.limits.low == 0)
    water.limits.low = -std::numeric_limits<double>::infinity();
  if (given != 1)
    faults.add(map.node(), "water",
               "must have exactly one of 'depth_m', 'wetness' and 'distance_m'");
  map.close();
  return water;
}

// Reads a condition on the canopy.
CoverLimits read_canopy(Map& entry, Faults& faults) {
  CoverLimits canopy = read_limits(entry, "canopy", "canopy_blend", share_rule, faults);
  // No share exceeds these, so they are no limits and have no ramp.
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (canopy.low == 0) canopy.low = -infinity;
  if (canopy.high == 1) canopy.high = infinity;
  return canopy;
}

}  // namespace

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

SiteConditions read_site(Map& entry, std::span<const TrailSpec> trails, Faults& faults) {
  SiteConditions site;
  if (auto beside = entry.map("trail", Need::Optional))
    site.trail = read_beside_trail(std::move(*beside), trails, faults);
  if (auto water = entry.map("water", Need::Optional))
    site.water = read_water(std::move(*water), faults);
  if (entry.find("canopy", Need::Optional) != nullptr ||
      entry.find("canopy_blend", Need::Optional) != nullptr)
    site.canopy = read_canopy(entry, faults);
  return site;
}

}  // namespace groundray::yaml
