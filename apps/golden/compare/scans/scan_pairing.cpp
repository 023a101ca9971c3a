#include "apps/golden/compare/scans/scan_pairing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "apps/golden/compare/scans/pulses.h"
#include "core/error.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

/// Pulses that may form a pair.
struct Candidate {
  double distance = 0;  ///< rad or s
  std::uint32_t reference = 0, other = 0;

  auto operator<=>(const Candidate&) const = default;
};

using Candidates = std::vector<Candidate>;

double median_of(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Adds a candidate.
/// @throws Error if there are so many that the tolerance must be too large.
void add_candidate(Candidates& candidates, const Candidate& candidate, std::size_t pulses) {
  constexpr std::size_t most_per_pulse = 64;
  candidates.push_back(candidate);
  if (candidates.size() > most_per_pulse * (pulses + 1)) {
    throw Error(
        "pairing: the tolerance permits more than {} partners per pulse: use about half of the "
        "spacing of the beams (--pair-mrad, --pair-s)",
        most_per_pulse);
  }
}

/// Time or azimuth and index of the pulses of one ring, in ascending order.
using Ring = std::vector<std::pair<double, std::uint32_t>>;

constexpr double full_turn_rad = 2 * std::numbers::pi;

/// Returns the coordinate that pairs the pulses of a ring: the time, s, or the azimuth from 0 to a
/// full turn, rad.
std::vector<double> places_of(const Pulses& pulses, PairingRule rule) {
  if (rule == PairingRule::RingTime) return pulses.times;
  std::vector<double> azimuths;
  for (const glm::dvec3& d : pulses.directions) {
    const double azimuth_rad = math::atan2(d.y, d.x);
    azimuths.push_back(azimuth_rad < 0 ? azimuth_rad + full_turn_rad : azimuth_rad);
  }
  return azimuths;
}

std::map<double, Ring> rings_of(const Pulses& pulses, const std::vector<double>& places) {
  std::map<double, Ring> rings;
  for (std::uint32_t i = 0; i < pulses.size(); ++i) {
    rings[pulses.rings[i]].emplace_back(places[i], i);
  }
  for (auto& [number, ring] : rings) std::ranges::sort(ring);
  return rings;
}

/// Returns the median distance between successive pulses in the rings, s or rad.
double median_step(const std::map<double, Ring>& rings) {
  std::vector<double> steps;
  for (const auto& [number, ring] : rings) {
    for (std::size_t i = 1; i < ring.size(); ++i) {
      const double step = ring[i].first - ring[i - 1].first;
      if (step > 0) steps.push_back(step);
    }
  }
  return median_of(std::move(steps));
}

/// Adds all pulses of `other` within `tolerance` of each pulse of `reference` displaced by `shift`;
/// a full turn wraps azimuths around.
void add_from_ring(const Ring& reference, const Ring& other, double tolerance, double shift,
                   std::size_t pulses, Candidates& candidates) {
  for (const auto& pulse : reference) {
    const double place = pulse.first + shift;
    auto at = std::ranges::lower_bound(other, place - tolerance, {}, &Ring::value_type::first);
    for (; at != other.end() && at->first <= place + tolerance; ++at) {
      add_candidate(candidates, {std::abs(at->first - place), pulse.second, at->second}, pulses);
    }
  }
}

double sound_tolerance(std::optional<double> asked, double step, const char* option) {
  if (asked && !(*asked > 0))
    throw Error("pairing: the tolerance, {}, must be positive ({})", *asked, option);
  if (asked) return *asked;
  return std::isfinite(step) ? step / 2 : same_pulse_rad;  // a lone pulse has no spacing
}

Candidates candidates_in_rings(const Pulses& reference, const Pulses& other,
                               const PairingOptions& options, Pairs& pairs) {
  const bool is_by_time = pairs.rule == PairingRule::RingTime;
  const auto reference_rings = rings_of(reference, places_of(reference, pairs.rule));
  const auto other_rings = rings_of(other, places_of(other, pairs.rule));
  pairs.tolerance =
      sound_tolerance(is_by_time ? options.tolerance_s : options.tolerance_rad,
                      median_step(reference_rings), is_by_time ? "--pair-s" : "--pair-mrad");
  Candidates candidates;
  for (const auto& [number, ring] : reference_rings) {
    const auto same = other_rings.find(number);
    if (same == other_rings.end()) continue;
    for (const double shift : {0., -full_turn_rad, full_turn_rad}) {
      if (shift != 0 && is_by_time) break;
      add_from_ring(ring, same->second, pairs.tolerance, shift, reference.size(), candidates);
    }
  }
  return candidates;
}

/// Returns the median angle from a pulse to its nearest; NaN for a single pulse. Pulses with equal
/// directions share the value of the first of them.
double median_spacing(const Pulses& pulses) {
  const std::vector<std::uint32_t> firsts = firsts_of(pulses.directions);
  std::vector<glm::dvec3> directions;
  for (std::uint32_t i = 0; i < firsts.size(); ++i) {
    if (firsts[i] == i) directions.push_back(pulses.directions[i]);
  }
  const DirectionTree tree(std::move(directions));
  std::vector<double> of_first(firsts.size()), spacings;
  for (std::uint32_t i = 0; i < firsts.size(); ++i) {
    if (firsts[i] == i) of_first[i] = tree.nearest_beyond(pulses.directions[i], same_pulse_rad);
    if (std::isfinite(of_first[firsts[i]])) spacings.push_back(of_first[firsts[i]]);
  }
  return median_of(std::move(spacings));
}

Candidates candidates_by_direction(const Pulses& reference, const Pulses& other,
                                   const PairingOptions& options, Pairs& pairs) {
  pairs.tolerance = sound_tolerance(options.tolerance_rad, pairs.spacing_rad, "--pair-mrad");
  const DirectionTree tree(other.directions);
  Candidates candidates;
  for (std::uint32_t i = 0; i < reference.size(); ++i) {
    tree.for_each_within(reference.directions[i], pairs.tolerance,
                         [&](std::uint32_t j, double angle_rad) {
                           add_candidate(candidates, {angle_rad, i, j}, reference.size());
                         });
  }
  return candidates;
}

Candidates candidates_by_number(const Scan& reference, const Pulses& reference_pulses,
                                const Scan& other, const Pulses& other_pulses) {
  std::map<double, std::uint32_t> known;
  for (std::uint32_t i = 0; i < other_pulses.size(); ++i) {
    known[(*other.find(Quantity::Pulse))[other_pulses.of(i)[0]]] = i;
  }
  Candidates candidates;
  for (std::uint32_t i = 0; i < reference_pulses.size(); ++i) {
    const auto found = known.find((*reference.find(Quantity::Pulse))[reference_pulses.of(i)[0]]);
    if (found != known.end()) candidates.push_back({0, i, found->second});
  }
  return candidates;
}

/// Returns true if the times of the scans overlap by at least half of the shorter one, or are
/// unknown.
bool times_overlap(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || b.empty()) return true;
  const auto [a_low, a_high] = std::ranges::minmax(a);
  const auto [b_low, b_high] = std::ranges::minmax(b);
  const double shared_s = std::min(a_high, b_high) - std::max(a_low, b_low);
  return shared_s >= std::min(a_high - a_low, b_high - b_low) / 2;
}

/// Returns the best rule that both scans permit, and notes why a better one cannot be used.
PairingRule best_rule(const Scan& reference, const Pulses& a, const Scan& other, const Pulses& b,
                      std::vector<std::string>& notes) {
  const auto both_have = [&](Quantity quantity) {
    return reference.find(quantity) != nullptr && other.find(quantity) != nullptr;
  };
  if (both_have(Quantity::Pulse)) return PairingRule::Pulse;
  if (!both_have(Quantity::Ring)) return PairingRule::Direction;
  if (!both_have(Quantity::Time)) return PairingRule::RingAzimuth;
  const bool tell_apart = !(a.times.empty() && a.size() > 0) && !(b.times.empty() && b.size() > 0);
  if (tell_apart && times_overlap(a.times, b.times)) return PairingRule::RingTime;
  notes.emplace_back(
      tell_apart ? "Their times do not overlap, so they were not used: give the other clock's time "
                   "at the scan's stamp (--time-zero-s)."
                 : "The times of one scan do not distinguish its pulses, so they were not used.");
  return PairingRule::RingAzimuth;
}

void check_rule(PairingRule rule, const Scan& reference, const Scan& other) {
  std::vector<std::pair<Quantity, std::string_view>> needed;
  if (rule == PairingRule::Pulse) needed = {{Quantity::Pulse, "pulse"}};
  if (rule == PairingRule::RingTime) needed = {{Quantity::Ring, "ring"}, {Quantity::Time, "time"}};
  if (rule == PairingRule::RingAzimuth) needed = {{Quantity::Ring, "ring"}};
  for (const auto& [quantity, name] : needed) {
    for (const Scan* scan : {&reference, &other}) {
      if (scan->find(quantity) != nullptr) continue;
      throw Error("{}: pairing by {} requires a usable column {}", scan->name, name_of(rule), name);
    }
  }
}

/// Accepts candidates greedily, nearest first.
/// @return pairs of pulses (reference, other) in ascending order of the reference's.
std::vector<std::pair<std::uint32_t, std::uint32_t>> accept(Candidates candidates,
                                                            std::size_t references,
                                                            std::size_t others) {
  std::ranges::sort(candidates, std::less<>());
  std::vector<bool> reference_taken(references), other_taken(others);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Candidate& candidate : candidates) {
    if (reference_taken[candidate.reference] || other_taken[candidate.other]) continue;
    reference_taken[candidate.reference] = other_taken[candidate.other] = true;
    pairs.emplace_back(candidate.reference, candidate.other);
  }
  std::ranges::sort(pairs);
  return pairs;
}

/// Sorted keys and indices of a pulse's returns; returns with equal keys form a pair.
using KeyedReturns = std::vector<std::pair<double, std::uint32_t>>;

KeyedReturns returns_by_index(const Scan& scan, std::span<const std::uint32_t> returns) {
  KeyedReturns keyed;
  for (const std::uint32_t i : returns)
    keyed.emplace_back((*scan.find(Quantity::ReturnIndex))[i], i);
  std::ranges::sort(keyed);
  return keyed;
}

/// Keys returns by their rank in range.
KeyedReturns returns_by_range(const Scan& scan, std::span<const std::uint32_t> returns) {
  KeyedReturns keyed;
  for (const std::uint32_t i : returns) keyed.emplace_back(glm::length(scan.p_S[i]), i);
  std::ranges::sort(keyed);
  for (std::size_t place = 0; place < keyed.size(); ++place)
    keyed[place].first = static_cast<double>(place);
  return keyed;
}

void pair_returns(const KeyedReturns& reference, const KeyedReturns& other, Pairs& pairs) {
  for (auto i = reference.begin(), j = other.begin(); i != reference.end() && j != other.end();) {
    if (i->first == j->first) {
      pairs.returns.emplace_back((i++)->second, (j++)->second);
    } else {
      ++(i->first < j->first ? i : j);
    }
  }
}

void list_unpaired(const Scan& reference, const Scan& other, Pairs& pairs) {
  std::ranges::sort(pairs.returns);
  std::vector<bool> reference_paired(reference.p_S.size()), other_paired(other.p_S.size());
  for (const auto& [i, j] : pairs.returns) reference_paired[i] = other_paired[j] = true;
  for (std::uint32_t i = 0; i < reference_paired.size(); ++i) {
    if (!reference_paired[i]) pairs.missing.push_back(i);
  }
  for (std::uint32_t j = 0; j < other_paired.size(); ++j) {
    if (!other_paired[j]) pairs.extra.push_back(j);
  }
}

}  // namespace

std::string_view name_of(PairingRule rule) {
  static constexpr std::array<std::string_view, 5> names{
      "the best rule", "pulse number", "ring and time", "ring and azimuth", "direction"};
  return names[static_cast<std::size_t>(rule)];
}

Pairs pair_scans(const Scan& reference, const Scan& other, const PairingOptions& options) {
  const Pulses a = pulses_of(reference), b = pulses_of(other);
  Pairs pairs;
  check_rule(options.rule, reference, other);
  pairs.rule = options.rule == PairingRule::Best ? best_rule(reference, a, other, b, pairs.notes)
                                                 : options.rule;
  if (pairs.rule == PairingRule::RingTime &&
      ((a.times.empty() && a.size() > 0) || (b.times.empty() && b.size() > 0))) {
    throw Error(
        "pairing: times do not distinguish the pulses: pair by ring and azimuth (--pair-by "
        "ring_azimuth)");
  }
  pairs.spacing_rad = median_spacing(a);
  Candidates candidates;
  if (pairs.rule == PairingRule::Pulse) {
    candidates = candidates_by_number(reference, a, other, b);
  } else if (pairs.rule == PairingRule::Direction) {
    candidates = candidates_by_direction(a, b, options, pairs);
  } else {
    candidates = candidates_in_rings(a, b, options, pairs);
  }
  const auto pulses = accept(std::move(candidates), a.size(), b.size());
  pairs.reference_pulses = a.size();
  pairs.other_pulses = b.size();
  pairs.paired_pulses = pulses.size();
  pairs.is_by_return_index = reference.find(Quantity::ReturnIndex) != nullptr &&
                             other.find(Quantity::ReturnIndex) != nullptr;
  const auto& keyed = pairs.is_by_return_index ? returns_by_index : returns_by_range;
  for (const auto& [i, j] : pulses)
    pair_returns(keyed(reference, a.of(i)), keyed(other, b.of(j)), pairs);
  list_unpaired(reference, other, pairs);
  return pairs;
}

}  // namespace groundray::golden
