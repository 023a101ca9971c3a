#pragma once

#include <optional>
#include <span>
#include <vector>

#include "reconstruction/mesh/scan/beam_rows.h"

namespace groundray {

/// Positions of a scan's returns in plan view.
struct PlanPlaces {
  std::span<const double> azimuths_rad;
  std::span<const double> distances_m;  ///< horizontal distance, m
};

/// Returns azimuths as the sensor saw them when each pulse fired, for points that were de-skewed to
/// one stamp while it moved: seen from the position at the stamp, rings that hit near surfaces
/// appear rotated against rings that hit far ones. Estimates the uniform motion in the x-y plane
/// for which the azimuths of each ring grow most evenly with the clock. The sensor's rotation
/// cannot be distinguished from that of its head and is left in.
/// @param clock  of each return, finite: times or column numbers.
/// @return nothing if azimuths are even already, or no motion makes them so.
std::optional<std::vector<double>> azimuths_as_fired(std::span<const double> clock,
                                                     const BeamRows& rows,
                                                     const PlanPlaces& places);

}  // namespace groundray
