#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>

#include "core/geometry/pose.h"
#include "sensors/camera/lens/lens_models.h"

namespace groundray {

/// Camera of a pair, as mounted.
struct StereoCamera {
  LensModel lens;
  glm::ivec2 size_px{0};
  Pose X_BC;
};

/// Two equal pinholes of one orientation, perpendicular to the baseline between them. Both see a
/// point in the same row; at the depth Z it is focal_px baseline_m / Z pixels further left in the
/// right image.
struct RectifiedPair {
  PixelScale scale;       ///< scale of both images; its focal lengths are equal
  glm::ivec2 size_px{0};  ///< size of both images
  Pose X_BL;              ///< pose of the left pinhole: at the position of its mounted camera
  Pose X_BR;              ///< pose of the right pinhole: at its camera, with the same orientation
  double baseline_m = 0;  ///< distance between the two
  glm::dquat R_LC, R_RC;  ///< from the axes of the mounted cameras to the rectified ones
};

/// Returns the rectified pair of two cameras, to be rendered directly: no image is resampled. The
/// rotation is the smallest possible: half of that from each camera to the other, then until x lies
/// along the baseline. The focal length is the mean of both on their axes. The centre balances the
/// viewing directions of the midpoints of all sides of both images about the middle of the image.
/// @throws Error listing all obstacles: images that differ in size; cameras that are rotated by
///         more than 60 degrees from each other; a right camera that is not to the right of the
///         left one within 45 degrees; a lens that sees nothing from the middle of a side inwards,
///         or more than 85 degrees from the common axis there; or as Lens.
/// @see Bouguet, Camera calibration toolbox for Matlab; Fusiello, Trucco and Verri, A compact
///      algorithm for rectification of stereo pairs, Machine Vision and Applications 12 (2000);
///      docs/theory/camera_rig.md
RectifiedPair rectified(const StereoCamera& left, const StereoCamera& right);

}  // namespace groundray
