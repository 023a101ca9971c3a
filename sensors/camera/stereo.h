#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>

#include "core/pose.h"
#include "sensors/camera/lens_models.h"

namespace groundray {

/// One camera of a pair, as mounted.
struct StereoCamera {
  LensModel lens;
  glm::ivec2 size_px{0};
  Pose X_BC;
};

/// Two equal pinholes that look the same way, across the line between them: what both see lies in
/// the same row of both images, and a point at the depth Z lies focal_px baseline_m / Z pixels
/// further left in the right image.
struct RectifiedPair {
  PixelScale scale;       ///< of both; its two focal lengths are equal
  glm::ivec2 size_px{0};  ///< of both
  Pose X_BL;              ///< of the left one: at the place of the camera that it stands for
  Pose X_BR;              ///< of the right one, turned likewise
  double baseline_m = 0;  ///< from the left one to the right
  glm::dquat R_LC, R_RC;  ///< from the axes of the cameras as mounted to the rectified ones
};

/// Returns the pair that two cameras are rectified to, for rendering it as it is: nothing is
/// resampled. It is turned as little as may be: half of the way from each camera to the other, then
/// until x lies along the baseline. Its focal length is the mean of both on their axes; its centre
/// puts what the middles of the images' sides see, of both cameras, round the middle of the image.
/// @throws Error naming all that stands against it: images that differ in size, cameras that are
///         turned by more than 60 degrees from each other, a right camera that is not to the right
///         of the left one within 45 degrees, a lens that sees more than 85 degrees from the common
///         axis at the middle of a side; or as Lens.
/// @see Bouguet, Camera calibration toolbox for Matlab; Fusiello, Trucco and Verri, A compact
///      algorithm for rectification of stereo pairs, Machine Vision and Applications 12 (2000);
///      docs/camera_rig.md
RectifiedPair rectified(const StereoCamera& left, const StereoCamera& right);

}  // namespace groundray
