#pragma once

#include <optional>
#include <span>
#include <vector>

#include "reconstruction/scan/beam_rows.h"

namespace groundray {

/// Where the returns of a scan lie, seen from above.
struct PlanPlaces {
  std::span<const double> azimuths_rad;
  std::span<const double> distances_m;  ///< along the plane x-y
};

/// Returns azimuths as the sensor saw them when each pulse fired, of points that were brought to
/// one stamp while it drove: seen from where it was at the stamp, rings that look at something near
/// seem turned against those that look far away. Found is the steady motion in the plane x-y by
/// which azimuths of each ring grow most evenly with the clock. How fast the sensor turned cannot
/// be told from how fast its head does, and is left in.
/// @param clock  of each return, finite: times or numbers of columns.
/// @return nothing if azimuths are even as they are, or no motion makes them so.
std::optional<std::vector<double>> azimuths_as_fired(std::span<const double> clock,
                                                     const BeamRows& rows,
                                                     const PlanPlaces& places);

}  // namespace groundray
