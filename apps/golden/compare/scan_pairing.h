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

/// By what two scans show that a pulse is the same.
enum class PairingRule {
  Best,         ///< the first below that both scans allow
  Pulse,        ///< equal numbers of pulses
  RingTime,     ///< equal rings, nearest times
  RingAzimuth,  ///< equal rings, nearest azimuths
  Direction     ///< nearest directions
};

struct PairingOptions {
  PairingRule rule = PairingRule::Best;
  /// How far apart azimuths or directions of one pulse may be; else half of the reference's median
  /// spacing: of neighbours in a ring, or of each beam to its nearest.
  std::optional<double> tolerance_rad;
  std::optional<double> tolerance_s;  ///< of times; else half of the median spacing in a ring
};

/// Which returns of two scans are one. Each is in one pair at the most.
struct Pairs {
  PairingRule rule = PairingRule::Direction;  ///< that was used
  double tolerance = 0;                       ///< rad, or s by time; 0 by number
  double spacing_rad = 0;           ///< median angle of the reference's pulses to the next
  bool is_by_return_index = false;  ///< within a pulse; else in order of range
  /// Indices of returns, of the reference and of the other, ascending by the first.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> returns;
  std::vector<std::uint32_t> missing;  ///< the reference's returns without one of the other
  std::vector<std::uint32_t> extra;    ///< and the other way round
  std::size_t reference_pulses = 0, other_pulses = 0, paired_pulses = 0;
  std::vector<std::string> notes;  ///< sentences: why a better rule could not be used
};

/// Returns of one scan belong to one pulse by the number of the pulse, else by equal ring and time,
/// else if their directions agree to 1e-5 rad (and ring or time, if there is one). Then pulses are
/// paired, nearest pairs first; then their returns.
/// @throws Error if the rule asked for needs a column that is not there, or if the tolerance is not
/// positive or lets each pulse have dozens of partners.
Pairs pair_scans(const Scan& reference, const Scan& other, const PairingOptions& options);

/// For people: "ring and time".
std::string_view name_of(PairingRule rule);

}  // namespace groundray::golden
