#pragma once

#include <array>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <optional>

#include "core/geometry/pose.h"
#include "reconstruction/stereo/stereo_view.h"

namespace groundray {

/// Two equal pinholes with a common orientation, perpendicular to their baseline: a point lies in
/// the same row of both images, and at the depth Z it lies focal_px baseline_m / Z pixels further
/// left in the right image.
struct PinholePair {
  double focal_px = 0;
  glm::dvec2 centre_px{0};  ///< principal point of both
  glm::ivec2 size_px{0};    ///< columns and rows of both
  Pose X_DL, X_DR;          ///< of equal rotation, each at the position of its camera
  double baseline_m = 0;    ///< from the left pinhole to the right one
  /// Fraction of the left and the right camera's pixels with a ray that the pinholes do not show,
  /// because the other camera does not see them or the field is limited.
  std::array<double, 2> lost_share{0, 0};

  const Pose& X_D(StereoSide side) const noexcept { return side == StereoSide::Left ? X_DL : X_DR; }
};

/// Returns the pair of pinholes to which the images of two cameras with any lenses are resampled.
/// They are turned as little as possible: half of the way from each camera to the other, by quarter
/// turns about the axis until the right camera is on the right (it may therefore be mounted on any
/// side of the left one), then until x lies along the baseline. The focal length is the mean of
/// both on their axes, which preserves the size of pixels there. The image is as high as the field
/// that both cameras see, and as wide as the field that either sees, because near objects lie
/// elsewhere in the other image; but at most `most_field_rad` each way, beyond which a pinhole's
/// image is mostly stretched.
/// @param most_field_rad  maximum width and height of the field, > 0 and < pi.
/// @throws Error naming all faults: an image without pixels, a view without its functions, cameras
///         at one position, turned by more than 60 degrees from each other, or one within 45
///         degrees of the axis of the other; a lens that does not image its axis; no common field;
///         an image of more than 2^26 pixels.
/// @see Bouguet, Camera calibration toolbox for Matlab; Fusiello, Trucco and Verri, A compact
///      algorithm for rectification of stereo pairs, Machine Vision and Applications 12 (2000)
PinholePair pinhole_pair(const StereoView& left, const StereoView& right,
                         double most_field_rad = glm::radians(110.0));

/// Returns the exact position in a camera's own image that a pixel of its pinhole shows; nothing if
/// the lens does not image it. The position may be outside the image.
std::optional<glm::dvec2> source_px(const PinholePair& pair, StereoSide side,
                                    const StereoView& view, glm::dvec2 pixel);

}  // namespace groundray
