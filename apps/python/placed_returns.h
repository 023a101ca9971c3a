#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "apps/python/sweep.h"
#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray::python {

/// Checks that there is at least one scan and none is None.
/// @param who  name of the caller, for the message.
/// @throws Error otherwise.
void check_scans(const char* who, const std::vector<const Sweep*>& scans);

/// Echoes of a sweep as the sensor reports them, at the poses that it knows, without ground truth.
struct PlacedReturns {
  std::vector<glm::dvec3> points_m;   ///< in D
  std::vector<glm::dvec3> origins_m;  ///< origin of each beam, in D
  std::vector<float> sd_m;            ///< standard deviation of each range
};

/// Returns the echoes of a sweep in D.
/// @param range_sd_m  replaces the standard deviations of the sweep or sensor.
PlacedReturns placed_returns(const Sweep& sweep, std::optional<double> range_sd_m);

/// Returns a sweep as an organised scan in D, with semantic classes.
/// @throws Error as organise, if the beams form no grid.
OrganisedScan organised(const Sweep& sweep, std::optional<double> range_sd_m, ReturnChoice choice);

}  // namespace groundray::python
