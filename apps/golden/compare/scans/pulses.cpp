#include "apps/golden/compare/scans/pulses.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/math.h"

namespace groundray::golden {
namespace {

/// Returns the chord of an angle on the unit sphere, enlarged by a bound of its rounding error.
double chord_of(double angle_rad) {
  constexpr double slack = 1 + 1e-12;
  return 2 * math::sin(std::min(angle_rad, std::numbers::pi) / 2) * slack + 1e-15;
}

constexpr std::uint32_t no_first = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t most_returns = 16;  // per pulse; sensors report up to five

/// Returns the group number of each element; groups are numbered in the order of their first
/// members.
std::vector<std::uint32_t> groups_by(std::size_t count, const auto& key_of) {
  std::map<decltype(key_of(0)), std::uint32_t> known;
  std::vector<std::uint32_t> groups(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto next = static_cast<std::uint32_t>(known.size());
    groups[i] = known.try_emplace(key_of(i), next).first->second;
  }
  return groups;
}

bool has_large_group(const std::vector<std::uint32_t>& groups) {
  std::vector<std::size_t> sizes(groups.size());
  return std::ranges::any_of(groups,
                             [&](std::uint32_t group) { return ++sizes[group] > most_returns; });
}

std::vector<glm::dvec3> directions_of(const Scan& scan) {
  std::vector<glm::dvec3> directions;
  directions.reserve(scan.p_S.size());
  for (const glm::dvec3& p : scan.p_S) directions.push_back(glm::normalize(p));
  return directions;
}

/// Returns the group number of each return: groups share direction, ring and time. Each ring and
/// time is searched separately, because all pulses of a fixed beam have the same direction.
std::vector<std::uint32_t> groups_by_direction(const Scan& scan, const std::vector<double>* rings,
                                               const std::vector<double>* times) {
  const std::vector<glm::dvec3> directions = directions_of(scan);
  std::map<std::pair<double, double>, std::vector<std::uint32_t>> alike;
  for (std::uint32_t i = 0; i < directions.size(); ++i) {
    alike[{rings == nullptr ? 0 : (*rings)[i], times == nullptr ? 0 : (*times)[i]}].push_back(i);
  }
  std::vector<std::uint32_t> firsts(directions.size());
  for (const auto& entry : alike) {
    const std::vector<std::uint32_t>& members = entry.second;
    std::vector<glm::dvec3> of_members;
    of_members.reserve(members.size());
    for (const std::uint32_t i : members) of_members.push_back(directions[i]);
    const std::vector<std::uint32_t> found = firsts_of(of_members);
    for (std::size_t i = 0; i < members.size(); ++i) firsts[members[i]] = members[found[i]];
  }
  return groups_by(firsts.size(), [&](std::size_t i) { return firsts[i]; });
}

Pulses pulses_by(const Scan& scan, const std::vector<std::uint32_t>& groups,
                 const std::vector<double>* rings, const std::vector<double>* times) {
  Pulses pulses;
  pulses.returns.resize(groups.size());
  std::iota(pulses.returns.begin(), pulses.returns.end(), 0U);
  std::ranges::stable_sort(pulses.returns, {}, [&](std::uint32_t i) { return groups[i]; });
  for (std::size_t at = 0; at < groups.size(); ++at) {
    const std::uint32_t i = pulses.returns[at];
    if (groups[i] == pulses.size()) {
      if (at > 0) pulses.begins.push_back(at);
      pulses.directions.push_back(glm::normalize(scan.p_S[i]));
      if (rings != nullptr) pulses.rings.push_back((*rings)[i]);
      if (times != nullptr) pulses.times.push_back((*times)[i]);
    }
  }
  if (!groups.empty()) pulses.begins.push_back(groups.size());
  return pulses;
}

}  // namespace

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return math::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

DirectionTree::DirectionTree(std::vector<glm::dvec3> directions)
    : directions_(std::move(directions)), order_(directions_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  split(0, order_.size(), 0);
}

void DirectionTree::split(std::size_t begin, std::size_t end, int axis) {
  if (end - begin < 2) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(directions_[a][axis], a) < std::pair(directions_[b][axis], b);
  });
  split(begin, middle, (axis + 1) % 3);
  split(middle + 1, end, (axis + 1) % 3);
}

/// Visits every direction that may be within `most_chord`, the nearer half first; `visit` may lower
/// `most_chord`.
template <typename Visit>
void DirectionTree::walk(std::size_t begin, std::size_t end, int axis, const glm::dvec3& direction,
                         const double& most_chord, const Visit& visit) const {
  if (begin == end) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const std::uint32_t index = order_[middle];
  const int next = (axis + 1) % 3;
  const double ahead = direction[axis] - directions_[index][axis];
  visit(index);
  if (ahead <= 0) {
    walk(begin, middle, next, direction, most_chord, visit);
    if (-ahead <= most_chord) walk(middle + 1, end, next, direction, most_chord, visit);
  } else {
    walk(middle + 1, end, next, direction, most_chord, visit);
    if (ahead <= most_chord) walk(begin, middle, next, direction, most_chord, visit);
  }
}

void DirectionTree::for_each_within(const glm::dvec3& direction, double most_rad,
                                    const std::function<void(std::uint32_t, double)>& take) const {
  const double most_chord = chord_of(most_rad);
  walk(0, order_.size(), 0, direction, most_chord, [&](std::uint32_t index) {
    if (glm::distance(direction, directions_[index]) > most_chord) return;
    const double angle_rad = angle_between(direction, directions_[index]);
    if (angle_rad <= most_rad) take(index, angle_rad);
  });
}

double DirectionTree::nearest_beyond(const glm::dvec3& direction, double least_rad) const {
  double best_rad = std::numeric_limits<double>::infinity();
  double most_chord = best_rad;
  walk(0, order_.size(), 0, direction, most_chord, [&](std::uint32_t index) {
    if (glm::distance(direction, directions_[index]) > most_chord) return;
    const double angle_rad = angle_between(direction, directions_[index]);
    if (angle_rad <= least_rad || angle_rad >= best_rad) return;
    best_rad = angle_rad;
    most_chord = chord_of(angle_rad);
  });
  return best_rad;
}

std::vector<std::uint32_t> firsts_of(const std::vector<glm::dvec3>& directions) {
  const DirectionTree tree(directions);
  std::vector<std::uint32_t> firsts(directions.size(), no_first);
  for (std::uint32_t i = 0; i < firsts.size(); ++i) {
    if (firsts[i] != no_first) continue;
    tree.for_each_within(directions[i], same_pulse_rad, [&](std::uint32_t other, double) {
      if (firsts[other] == no_first) firsts[other] = i;
    });
    firsts[i] = i;  // also if the direction is NaN
  }
  return firsts;
}

Pulses pulses_of(const Scan& scan) {
  const std::size_t count = scan.p_S.size();
  const auto* const rings = scan.find(Quantity::Ring);
  const auto* times = scan.find(Quantity::Time);
  std::vector<std::uint32_t> groups;
  if (times != nullptr) {
    groups = groups_by(count, [&](std::size_t i) {
      return std::pair(rings == nullptr ? 0 : (*rings)[i], (*times)[i]);
    });
    if (rings != nullptr && has_large_group(groups)) times = nullptr;
  }
  if (const auto* const numbers = scan.find(Quantity::Pulse)) {
    groups = groups_by(count, [numbers](std::size_t i) { return (*numbers)[i]; });
  } else if (rings == nullptr || times == nullptr) {
    groups = groups_by_direction(scan, rings, times);
  }
  return pulses_by(scan, groups, rings, times);
}

}  // namespace groundray::golden
