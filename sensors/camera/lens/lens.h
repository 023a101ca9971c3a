#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "sensors/camera/lens/lens_models.h"

namespace groundray {

/// Viewing direction of a pixel, in C, and its derivatives.
struct PixelRay {
  glm::dvec3 direction{0};      ///< unit
  glm::dvec3 by_u{0}, by_v{0};  ///< derivatives by the pixel's coordinates, 1/px
};

/// Returns the solid angle of a pixel, sr.
inline double pixel_sr(const PixelRay& ray) noexcept {
  return glm::length(glm::cross(ray.by_u, ray.by_v));
}

/// Lens model with an image size: a one-to-one mapping between the directions that it images and
/// positions in the image.
///
/// A direction is imaged if the model's Jacobian determinant is positive all the way to it from the
/// optical axis. Beyond the first fold or pole, several directions share a pixel, and the model
/// does not describe the camera. (Far outside the image, where tangential terms outweigh all
/// others, directions before the fold may share pixels too.) Immutable; any number of threads may
/// use one.
/// @see docs/theory/camera_lens.md
class Lens {
 public:
  /// @throws Error listing every parameter that is out of bounds: an image without pixels or with
  ///         more than 2^28, a number that is not finite, a focal length that is not positive, and
  ///         others as their models require; or if the model images nothing near its axis.
  Lens(LensModel model, glm::ivec2 size_px);

  const LensModel& model() const noexcept { return model_; }
  glm::ivec2 size_px() const noexcept { return size_px_; }

  /// Returns true if a direction, unit, is imaged.
  bool images(const glm::dvec3& direction) const noexcept;

  /// Returns the position at which a point of C, or a direction, is imaged, inside the image or
  /// outside; nullopt if it is not imaged.
  std::optional<glm::dvec2> project(const glm::dvec3& p_C) const noexcept;

  /// Returns the viewing direction of a position in the image: its image is that position to 1e-9
  /// px, or, where the image is steep near a pole, to the shift that 1e-15 rad causes. nullopt if
  /// no imaged direction has this position.
  std::optional<PixelRay> ray(glm::dvec2 pixel) const noexcept;

  /// Returns the focal length of a pinhole whose pixel on the axis has the same solid angle;
  /// nullopt if the axis is not imaged.
  std::optional<double> focal_px() const noexcept;

  /// Computes the rays of all pixel centres of rows [begin, end), row by row, with derivatives to
  /// 1e-6, relative. Pixels without a viewing direction get a direction of zero.
  void fill(int begin, int end, std::span<PixelRay> rays) const;

  /// Returns the angle from the axis up to which directions are imaged towards an azimuth of C
  /// (from x to y), rad.
  double limit_rad(double azimuth_rad) const noexcept;

 private:
  LensModel model_;
  glm::ivec2 size_px_;
  std::vector<double> limits_rad_;  // by azimuth
  double least_limit_rad_ = 0;
  std::vector<double> reach_px_;  // radius of the imaged field, by azimuth in the image
};

}  // namespace groundray
