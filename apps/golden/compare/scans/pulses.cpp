#include "apps/golden/compare/scans/pulses.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "apps/golden/compare/scans/direction_tree.h"

namespace groundray::golden {
namespace {

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
