#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "sensors/camera/lens_models.h"

namespace groundray {

/// Where a pixel looks, in C, and how that changes across the image.
struct PixelRay {
  glm::dvec3 direction{0};      ///< unit
  glm::dvec3 by_u{0}, by_v{0};  ///< its derivative by the pixel's coordinates, 1/px
};

/// A lens model on an image: the directions that it images one to one, both ways.
///
/// A direction is imaged if the model's Jacobian determinant is positive all the way to it from the
/// optical axis: beyond the first fold or pole other directions share its pixel, and the model says
/// nothing about the camera. (Far outside of the image, where tangential terms outweigh all others,
/// directions before the fold may share pixels too.) Immutable; any number of threads may use one.
/// @see docs/camera_lens.md
class Lens {
 public:
  /// @throws Error listing every parameter that is out of bounds: an image of no pixels or more
  ///         than 2^28, a number that is not finite, a focal length that is not positive, others as
  ///         their models say; or if the model images nothing near its axis.
  Lens(LensModel model, glm::ivec2 size_px);

  const LensModel& model() const noexcept { return model_; }
  glm::ivec2 size_px() const noexcept { return size_px_; }

  /// Whether a direction, unit, is imaged.
  bool images(const glm::dvec3& direction) const noexcept;

  /// Returns where a point of C, or a direction, falls: inside the image or not. Nothing if it is
  /// not imaged.
  std::optional<glm::dvec2> project(const glm::dvec3& p_C) const noexcept;

  /// Returns where a pixel looks: the direction whose image it is to 1e-9 px; where the image is
  /// steep beside a pole, to what 1e-15 rad move it. Nothing if there is none that is imaged.
  std::optional<PixelRay> ray(glm::dvec2 pixel) const noexcept;

  /// Fills the rays (and their derivatives, to 1e-6 of them) of all pixel centres of rows [begin,
  /// end), row by row; those that look nowhere have a direction of zero.
  void fill(int begin, int end, std::span<PixelRay> rays) const;

  /// How far from the axis directions are imaged towards an azimuth of C (from x to y), rad.
  double limit_rad(double azimuth_rad) const noexcept;

 private:
  LensModel model_;
  glm::ivec2 size_px_;
  std::vector<double> limits_rad_;  // by azimuth, all round
  double least_limit_rad_ = 0;
  std::vector<double> reach_px_;  // and how far in the image they reach, by azimuth there
};

}  // namespace groundray
