#pragma once

#include "apps/scene/world.h"
#include "core/image.h"
#include "core/point_cloud.h"

namespace groundray {

/// Draws a scan for people: its range image above (one band for each beam, the highest on top,
/// azimuth from left behind to right behind, near is bright), below a hillshade of the DEM round
/// the sensor with the scan's points.
Image8 draw_preview(const PointCloud& scan, const PlacedLidar& lidar, const Ground& ground,
                    std::int64_t frame);

}  // namespace groundray
