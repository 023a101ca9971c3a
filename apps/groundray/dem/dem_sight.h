#pragma once

#include "apps/groundray/dem/dem_points.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// Source of upper bounds for ground that was not measured: none, or passing beams.
enum class SightUse { None, Beams };

/// Lowers `layers.upper_bound_m` to the heights at which beams of a scan pass, each raised by two
/// standard deviations of its point's height, including those of its pose. Beams that end where
/// nothing was measured, or below the measured ground, are omitted: their points may be outliers.
/// @param points    points of the scan, none of which have been read.
/// @param margin_m  margin added to the bound, see sight_bound.
/// @throws Error as LidarPoints.
void bound_by_sight(LidarPoints& points, double margin_m, DemLayers& layers);

}  // namespace groundray
