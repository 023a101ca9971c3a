#pragma once

#include <array>
#include <functional>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "core/geometry/pose.h"
#include "core/image/image.h"

namespace groundray {

/// Camera for stereo: its pose, and the exact relation between pixels and rays. Both functions may
/// be called by several threads at a time.
struct StereoView {
  glm::ivec2 size_px{0};  ///< columns and rows; integer coordinates are pixel centres
  Pose X_DC;              ///< pose of C in D; C: x right, y down, z ahead
  /// Returns the image position of a point of C, or of a direction: inside the image or not.
  /// Nothing if it is not imaged.
  std::function<std::optional<glm::dvec2>(const glm::dvec3& p_C)> project;
  /// Returns the direction of a pixel's ray in C, of any length. Nothing if it has none.
  std::function<std::optional<glm::dvec3>(glm::dvec2 pixel)> ray;
};

/// Side of a camera in a pair: depths belong to the pixels of the left one.
enum class StereoSide { Left, Right };

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
/// They are turned as little as possible, by quarter turns about the axis until the right camera is
/// on the right: it may be mounted on any side of the left one. The focal length is the mean of
/// both on their axes. The image is as high as the field that both cameras see and as wide as the
/// field that either sees, but at most `most_field_rad` each way, beyond which it is mostly
/// stretched.
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

/// Image of one pinhole of a pair.
struct RectifiedImage {
  ImageF grey;  ///< 1 channel; 0 where unseen
  Image8 seen;  ///< 1 where the camera's own image shows the position
};

/// Returns an image as the pinhole of its side would have recorded it: interpolated at each pixel's
/// exact position by a Lanczos window of three lobes. Where the camera's pixels on the axis are
/// finer than the pinhole's, the window is wider by the same factor. Beyond the boundary, the
/// boundary's values are used.
/// @param grey  1 channel, as recorded by the camera; a pixel that is not finite makes those around
///        it unseen.
/// @throws Error if the image does not have 1 channel and the size of `view`.
/// @see Duchon, Lanczos filtering in one and two dimensions, Journal of Applied Meteorology 18
///      (1979)
RectifiedImage resample(const ImageF& grey, const PinholePair& pair, StereoSide side,
                        const StereoView& view);

/// Returns the luminance of an image of 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB,
/// alpha), with 255 as 1. It stays encoded for the eye, which suits matching best.
/// @throws Error for other numbers of channels.
ImageF grey_of(const Image8& image);

}  // namespace groundray
