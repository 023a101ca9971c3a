#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/compare/scans/scan_pairing.h"
#include "apps/golden/report.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// Differences between the other's returns and the reference's, one value per pair.
struct ScanErrors {
  std::vector<double> range_m;    ///< other's range minus the reference's
  std::vector<double> angle_rad;  ///< angle between the directions
  std::vector<double> lateral_m;  ///< distance of the other's point from the reference's beam
};

ScanErrors errors_of(const Scan& reference, const Scan& other, const Pairs& pairs);

/// Returns the rotation vector that best maps the reference's directions to the other's, by least
/// squares for small angles; nothing if the directions do not determine it.
std::optional<glm::dvec3> turn_between(const Scan& reference, const Scan& other,
                                       const Pairs& pairs);

/// Returns a table by the reference's range, in steps of 1, 2, 5, 10, ... m; extra returns are
/// classed by the other's range.
Table table_by_range(const Scan& reference, const Scan& other, const Pairs& pairs,
                     const ScanErrors& errors);
/// Returns a table by the reference's angle of incidence, in steps of 15 degrees; nothing if it has
/// none.
std::optional<Table> table_by_incidence(const Scan& reference, const Pairs& pairs,
                                        const ScanErrors& errors);
/// Returns a table by the reference's label, for the 40 most frequent; nothing if it has none.
std::optional<Table> table_by_label(const Scan& reference, const Pairs& pairs,
                                    const ScanErrors& errors);
/// Returns a table of the pairs with the largest range errors.
Table table_of_largest(const Scan& reference, const Scan& other, const Pairs& pairs,
                       const ScanErrors& errors);

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
