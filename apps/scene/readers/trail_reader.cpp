#include <algorithm>
#include <glm/trigonometric.hpp>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/math.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

constexpr Rule bank_rule{[](double value) { return value >= 1 && value <= 89; },
                         "must be from 1 to 89"};
constexpr Rule grade_rule{[](double value) { return value > 0 && value <= 80; },
                          "must be > 0 and at most 80"};

// Reads an angle in degrees as rise over run.
void read_slope(Map& map, std::string_view key, Rule rule, double& slope) {
  double angle_deg = 0;
  if (map.read_number(key, Need::Optional, angle_deg, rule) != nullptr)
    slope = math::tan(glm::radians(angle_deg));
}

TrailSpec::Ruts read_ruts(Map map) {
  TrailSpec::Ruts ruts;
  map.read_number("track_m", Need::Optional, ruts.track_m, positive);
  map.read_number("width_m", Need::Optional, ruts.width_m, positive);
  map.read_number("depth_m", Need::Required, ruts.depth_m, not_negative);
  map.read_number("berm_m", Need::Optional, ruts.berm_m, not_negative);
  map.close();
  return ruts;
}

TrailSpec::Washboard read_washboard(Map map) {
  TrailSpec::Washboard washboard;
  map.read_number("wavelength_m", Need::Required, washboard.wavelength_m, positive);
  map.read_number("amplitude_m", Need::Required, washboard.amplitude_m, not_negative);
  map.close();
  return washboard;
}

TrailSpec::Potholes read_potholes(Map map) {
  TrailSpec::Potholes potholes;
  map.read_number("per_100_m", Need::Required, potholes.per_100_m, not_negative);
  map.read_vector("diameter_m", Need::Optional, potholes.diameter_m, positive);
  map.read_number("depth_m", Need::Optional, potholes.depth_m, not_negative);
  map.close();
  return potholes;
}

TrailSpec::Ditches read_ditches(Map map) {
  TrailSpec::Ditches ditches;
  map.read_number("width_m", Need::Required, ditches.width_m, positive);
  map.read_number("depth_m", Need::Required, ditches.depth_m, not_negative);
  map.read_choice("side", Need::Optional, ditches.side, {"both", "left", "right"});
  map.close();
  return ditches;
}

TrailSpec::Roots read_roots(Map map) {
  TrailSpec::Roots roots;
  map.read_number("per_100_m", Need::Required, roots.per_100_m, not_negative);
  map.read_number("width_m", Need::Optional, roots.width_m, positive);
  map.read_number("height_m", Need::Optional, roots.height_m, not_negative);
  map.close();
  return roots;
}

Benches read_benches(Map map) {
  Benches benches;
  map.read_number("height_m", Need::Required, benches.height_m, positive);
  map.read_number("width_m", Need::Required, benches.width_m, positive);
  map.read_number("roughness_m", Need::Optional, benches.roughness_m, not_negative);
  if (auto part = map.map("blocks", Need::Optional)) {
    auto& blocks = benches.blocks.emplace();
    part->read_number("length_m", Need::Optional, blocks.length_m, positive);
    part->read_number("height_m", Need::Optional, blocks.height_m, positive);
    part->close();
  }
  map.close();
  return benches;
}

TrailSpec read_trail(Map map, Faults& faults) {
  TrailSpec trail;
  map.read_text("name", Need::Required, trail.name);
  if (const Node* const between = map.find("between_m", Need::Optional)) {
    const auto ends = read_points(map.list("between_m", Need::Required), "between_m", faults);
    if (ends.size() == 2)
      trail.between_m = {ends[0], ends[1]};
    else if (between->kind == Node::Kind::List)
      faults.add(*between, "between_m", "has {} points, but must have two", ends.size());
    if (map.find("waypoints_m", Need::Optional) != nullptr)
      faults.add(*between, "between_m", "must not be given together with 'waypoints_m'");
  } else {
    trail.waypoints_m = read_waypoints(map, "trail", faults);
  }
  map.read_number("width_m", Need::Optional, trail.width_m, positive);
  map.read_number("raised_m", Need::Optional, trail.raised_m);
  map.read_number("level_over_m", Need::Optional, trail.level_over_m, not_negative);
  read_slope(map, "bank_deg", bank_rule, trail.bank_slope);
  map.read_number("most_bank_m", Need::Optional, trail.most_bank_m, not_negative);
  read_slope(map, "most_grade_deg", grade_rule, trail.most_grade);
  map.read_number("crown_m", Need::Optional, trail.crown_m, not_negative);
  map.read_number("relief_share", Need::Optional, trail.relief_share, share_rule);
  map.read_number("variation", Need::Optional, trail.variation, share_rule);
  map.read_whole("variant", Need::Optional, trail.variant.value);
  if (auto part = map.map("ruts", Need::Optional)) trail.ruts = read_ruts(std::move(*part));
  if (auto part = map.map("washboard", Need::Optional))
    trail.washboard = read_washboard(std::move(*part));
  if (auto part = map.map("potholes", Need::Optional))
    trail.potholes = read_potholes(std::move(*part));
  if (auto part = map.map("ditches", Need::Optional))
    trail.ditches = read_ditches(std::move(*part));
  if (auto part = map.map("roots", Need::Optional)) trail.roots = read_roots(std::move(*part));
  if (auto part = map.map("benches", Need::Optional))
    trail.benches = read_benches(std::move(*part));
  map.close();
  return trail;
}

}  // namespace

std::vector<glm::dvec2> read_waypoints(Map& map, std::string_view what, Faults& faults) {
  const auto pairs = map.list("waypoints_m", Need::Required);
  const Node* const at = map.find("waypoints_m", Need::Optional);
  if (at != nullptr && at->kind == Node::Kind::List && pairs.size() < 2)
    faults.add(*at, "waypoints_m", "has {} points, but a {} needs at least two", pairs.size(),
               what);
  return read_points(pairs, "waypoints_m", faults);
}

std::vector<TrailSpec> read_trails(Map& terrain, Faults& faults) {
  std::vector<TrailSpec> trails;
  UniqueNames names("trail", faults);
  for (const Node& node : terrain.list("trails", Need::Optional)) {
    trails.push_back(read_trail(Map(node, "trails", faults), faults));
    names.add(node, trails.back().name);
  }
  return trails;
}

const TrailSpec* find_trail(Map& map, std::string_view key, std::span<const TrailSpec> trails,
                            Faults& faults) {
  std::string name;
  const Node* const at = map.read_text(key, Need::Optional, name);
  if (at == nullptr) return nullptr;
  const auto found = std::ranges::find(trails, name, &TrailSpec::name);
  if (found != trails.end()) return &*found;
  std::vector<std::string> names;
  for (const TrailSpec& trail : trails) names.push_back(trail.name);
  faults.add(*at, key, "there is no trail '{}' under terrain.trails{}", name,
             suggestion(name, names));
  return nullptr;
}

}  // namespace groundray::yaml
