#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/compare/scan_pairing.h"
#include "apps/golden/report.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// How the other's returns differ from the reference's: one value for each pair.
struct ScanErrors {
  std::vector<double> range_m;    ///< other's range - reference's
  std::vector<double> angle_rad;  ///< between the directions
  std::vector<double> lateral_m;  ///< from the reference's beam to the other's point
};

ScanErrors errors_of(const Scan& reference, const Scan& other, const Pairs& pairs);

/// Returns the rotation vector that turns the reference's directions into the other's best by least
/// squares, for small angles; nothing if the directions do not tell.
std::optional<glm::dvec3> turn_between(const Scan& reference, const Scan& other,
                                       const Pairs& pairs);

/// Returns rows by the reference's range in steps of 1, 2, 5, 10, ... m; extra returns go by the
/// other's range.
Table table_by_range(const Scan& reference, const Scan& other, const Pairs& pairs,
                     const ScanErrors& errors);
/// Returns rows by the reference's angle of incidence in steps of 15 degrees, if it tells any.
std::optional<Table> table_by_incidence(const Scan& reference, const Pairs& pairs,
                                        const ScanErrors& errors);
/// Returns rows by the reference's label, the 40 most frequent, if it tells any.
std::optional<Table> table_by_label(const Scan& reference, const Pairs& pairs,
                                    const ScanErrors& errors);
/// Returns the pairs whose ranges differ most.
Table table_of_largest(const Scan& reference, const Scan& other, const Pairs& pairs,
                       const ScanErrors& errors);

}  // namespace groundray::golden
