#pragma once

#include "core/image/image.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_truth.h"

namespace groundray {

/// Draws a preview of an image, as panels: its radiance, with automatic brightness, and the depth,
/// normals and labels of its truth. Missing parts are omitted.
/// @param light, truth  one of them may be null.
Image8 draw_image_preview(const Exposure* light, const ImageTruth* truth);

}  // namespace groundray
