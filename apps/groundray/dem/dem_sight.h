#pragma once

#include "apps/groundray/dem/dem_points.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// What tells how high the ground can be where nothing measured it: nothing, or beams that passed.
enum class SightUse { None, Beams };

/// Lowers `layers.upper_bound_m` to the heights that beams of a scan pass at, each raised by two
/// standard deviations of its point's height, those of its pose counted. A beam that ends where
/// nothing was measured, or below what was, is left out: its point may be an outlier.
/// @param points    of the scan, from the first on.
/// @param margin_m  added, see sight_bound.
/// @throws Error as LidarPoints.
void bound_by_sight(LidarPoints& points, double margin_m, DemLayers& layers);

}  // namespace groundray
