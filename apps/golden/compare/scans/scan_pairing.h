#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/scan/scan.h"

namespace groundray::golden {

/// Criterion by which pulses of two scans are paired.
enum class PairingRule {
  Best,         ///< first of the following that both scans permit
  Pulse,        ///< equal pulse numbers
  RingTime,     ///< equal rings, nearest times
  RingAzimuth,  ///< equal rings, nearest azimuths
  Direction     ///< nearest directions
};

struct PairingOptions {
  PairingRule rule = PairingRule::Best;
  /// Largest difference of azimuths or directions of a pair; by default half of the reference's
  /// median spacing, between neighbours in a ring or from each beam to its nearest.
  std::optional<double> tolerance_rad;
  /// Largest time difference of a pair; by default half of the median spacing in a ring.
  std::optional<double> tolerance_s;
};

/// Pairs of corresponding returns of two scans. Each return is in at most one pair.
struct Pairs {
  PairingRule rule = PairingRule::Direction;  ///< rule that was used
  double tolerance = 0;                       ///< rad; s for RingTime; 0 for Pulse
  double spacing_rad = 0;           ///< median angle from the reference's pulses to their nearest
  bool is_by_return_index = false;  ///< true if returns pair by index, else by order of range
  /// Indices of paired returns (reference, other), in ascending order of the first.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> returns;
  std::vector<std::uint32_t> missing;  ///< returns of the reference without a partner
  std::vector<std::uint32_t> extra;    ///< returns of the other without a partner
  std::size_t reference_pulses = 0, other_pulses = 0, paired_pulses = 0;
  std::vector<std::string> notes;  ///< sentences that state why a better rule could not be used
};

/// Pairs the returns of two scans. Returns of one scan belong to the same pulse if their pulse
/// numbers are equal; without numbers, if ring and time are equal; else if their directions agree
/// to 1e-5 rad (and ring or time, if available). Pulses are paired first, nearest pairs first, and
/// then their returns.
/// @throws Error if the requested rule needs a column that is missing or does not distinguish
///         pulses, or if the tolerance is not positive or permits dozens of partners per pulse.
Pairs pair_scans(const Scan& reference, const Scan& other, const PairingOptions& options);

/// Returns the name of a rule for messages, such as "ring and time".
std::string_view name_of(PairingRule rule);

}  // namespace groundray::golden
