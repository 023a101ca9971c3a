#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/compare/scans/scan_errors.h"
#include "apps/golden/compare/scans/scan_pairing.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// Returns warnings if the scans seem to have different units or frames: if the ratio of their
/// median ranges is near 1000, 1/1000, 100 or feet per metre, or not within 0.1 to 10, or if their
/// points lie far apart.
std::vector<std::string> doubts_about(const Scan& reference, const Scan& other);

/// Returns warnings on suspicious pairs: rings, times or pulses that are counted differently, a
/// sensor that is turned, or scans with different beam directions.
/// @param turn_rad  result of turn_between.
std::vector<std::string> doubts_about(const Pairs& pairs, const ScanErrors& errors,
                                      const std::optional<glm::dvec3>& turn_rad);

/// Returns a warning if the column of ranges does not match the distances of the points.
std::vector<std::string> doubts_about_ranges(const Scan& scan);

}  // namespace groundray::golden
