#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "apps/python/sweep.h"
#include "reconstruction/scan/organised_scan.h"

namespace groundray::python {

/// @throws Error unless there is a scan and none of them is None. @param who  for the message.
void check_scans(const char* who, const std::vector<const Sweep*>& scans);

/// The echoes of a sweep as the sensor reported them, at the poses that it knew: nothing of the
/// truth.
struct PlacedReturns {
  std::vector<glm::dvec3> points_m;   ///< in D
  std::vector<glm::dvec3> origins_m;  ///< where each beam began, in D
  std::vector<float> sd_m;            ///< of each range
};

/// @param range_sd_m  instead of what sweep and sensor say.
PlacedReturns placed_returns(const Sweep& sweep, std::optional<double> range_sd_m);

/// Returns a sweep on the grid of its beams, in D, with semantic classes.
/// @throws Error as organise, if there is no such grid.
OrganisedScan organised(const Sweep& sweep, std::optional<double> range_sd_m, ReturnChoice choice);

}  // namespace groundray::python
