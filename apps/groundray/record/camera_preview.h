#pragma once

#include "core/image.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_truth.h"

namespace groundray {

/// Draws an image for people: its light, as bright as suits the eye, and of its truth the depth,
/// the normals and the labels, side by side; what is not there is left out.
/// @param light, truth  may be null.
Image8 draw_image_preview(const Exposure* light, const ImageTruth* truth);

}  // namespace groundray
