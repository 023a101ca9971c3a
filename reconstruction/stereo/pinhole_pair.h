#pragma once

#include <array>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <optional>

#include "core/pose.h"
#include "reconstruction/stereo/stereo_view.h"

namespace groundray {

/// Two equal pinholes that look the same way, across the line between them: what both see lies in
/// the same row of both images, and a point at the depth Z lies focal_px baseline_m / Z pixels
/// further left in the right image.
struct PinholePair {
  double focal_px = 0;
  glm::dvec2 centre_px{0};  ///< principal point of both
  glm::ivec2 size_px{0};    ///< of both
  Pose X_DL, X_DR;          ///< turned alike; each at the place of the camera that it stands for
  double baseline_m = 0;    ///< from the left one to the right
  /// Of the pixels of the left and of the right camera that look somewhere, the share that the
  /// pinholes do not see: because the other one does not look there, or the field is limited.
  std::array<double, 2> lost_share{0, 0};

  const Pose& X_D(StereoSide side) const noexcept { return side == StereoSide::Left ? X_DL : X_DR; }
};

/// Returns the pair of pinholes that two cameras of any lenses are resampled to. They are turned as
/// little as may be: half of the way from each camera to the other, by quarters of a turn about the
/// axis until the right camera is on the right (so it may be mounted on any side of the left one),
/// then until x lies along the baseline. The focal length is the mean of both on their axes, where
/// a pixel stays as large as it is. The image is as high as what both see, and as wide as what
/// either sees, since near things lie elsewhere in the other image; but no more than
/// `most_field_rad` each way, beyond which a pinhole's image is mostly stretching.
/// @param most_field_rad  width and height of the field at most, > 0 and < pi.
/// @throws Error naming all that stands against it: an image of no pixels, a view without its
///         functions, cameras at one place, turned by more than 60 degrees from each other, or one
///         within 45 degrees of the axis of the other; a lens that does not image its axis;
///         nothing that both see; an image of more than 2^26 pixels.
/// @see Bouguet, Camera calibration toolbox for Matlab; Fusiello, Trucco and Verri, A compact
///      algorithm for rectification of stereo pairs, Machine Vision and Applications 12 (2000)
PinholePair pinhole_pair(const StereoView& left, const StereoView& right,
                         double most_field_rad = glm::radians(110.0));

/// Returns which place of a camera's own image a pixel of its pinhole shows, exactly; nothing if
/// the lens does not image it. The place may be outside of the image.
std::optional<glm::dvec2> source_px(const PinholePair& pair, StereoSide side,
                                    const StereoView& view, glm::dvec2 pixel);

}  // namespace groundray
