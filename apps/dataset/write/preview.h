#pragma once

#include <cstdint>

#include "apps/scene/simulation.h"
#include "core/image/image.h"
#include "core/io/point_cloud.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_truth.h"

namespace groundray {

/// Draws a preview of a scan. The upper part is its range image, with one band per beam, the
/// highest on top; azimuth runs from behind over left, ahead and right to behind; near is bright.
/// The lower part is a hillshade of the DEM round the sensor, with the scan's points.
Image8 draw_preview(const PointCloud& scan, const PlacedLidar& lidar, const Ground& ground,
                    std::int64_t frame);

/// Draws a preview of an image, as panels: its radiance, with automatic brightness, and the depth,
/// normals and labels of its truth. Missing parts are omitted.
/// @param light, truth  one of them may be null.
Image8 draw_image_preview(const Exposure* light, const ImageTruth* truth);

/// Draws linear RGB at full size, as the preview draws radiance.
/// @param exposed_for  radiance whose preview has the same brightness: 1 % of its values are white.
Image8 draw_radiance(const ImageF& radiance, const ImageF& exposed_for);

}  // namespace groundray
