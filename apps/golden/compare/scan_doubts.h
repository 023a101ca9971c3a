#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/compare/scan_errors.h"
#include "apps/golden/compare/scan_pairing.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// Returns sentences on what looks as if the scans had different units or frames: medians of the
/// range in a ratio of 1000, of feet to metres or beyond 10, or points far from each other's.
std::vector<std::string> doubts_about(const Scan& reference, const Scan& other);

/// Returns sentences on pairs that look wrong: other rings or times than those of the same name, a
/// sensor that is turned, or directions that differ because each scan has its own.
/// @param turn_rad  as turn_between.
std::vector<std::string> doubts_about(const Pairs& pairs, const ScanErrors& errors,
                                      const std::optional<glm::dvec3>& turn_rad);

/// Returns sentences on columns of ranges that are not the distances of the points.
std::vector<std::string> doubts_about_ranges(const Scan& scan);

}  // namespace groundray::golden
