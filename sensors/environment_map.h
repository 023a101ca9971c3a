#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "core/image.h"
#include "sensors/direction_sampler.h"
#include "sensors/lat_long_grid.h"

namespace groundray {

/// The values of an image are radiances but for a factor.
struct RadianceScale {
  double factor = 1;
};
/// The values of an image are scaled so that a horizontal plane gets this illuminance from above.
struct IlluminanceScale {
  double lux = 0;
};
/// What the values of an image mean.
using EnvironmentScale = std::variant<RadianceScale, IlluminanceScale>;

/// What shines from every direction, by an equirectangular image. Linear sRGB radiance in
/// W/(m^2 sr), each channel weighed by the eye's colour matching functions. Immutable, so any
/// number of threads may use one. Holds 24 bytes a pixel of three channels.
class EnvironmentMap {
 public:
  /// @param image  1 channel (grey) or 3 (R, G, B), and maybe alpha, which is ignored; laid out as
  ///        LatLongGrid says.
  /// @param center_azimuth_rad  of the image's middle, clockwise from north.
  /// @throws Error naming the pixels that are NaN, infinite or negative, an image without light,
  ///         or what else is out of bounds.
  EnvironmentMap(ImageF image, double center_azimuth_rad, const EnvironmentScale& scale);

  /// Returns what comes from a unit direction (axes of W: east, north, up), bilinear.
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

  /// Draws a direction about in proportion to its luminance. @see DirectionSampler
  DirectionSample sample(const glm::dvec2& uniform) const noexcept {
    return sampler_.sample(uniform);
  }
  double pdf_per_sr(const glm::dvec3& direction) const noexcept {
    return sampler_.pdf_per_sr(direction);
  }

  /// Returns the irradiance of a horizontal plane from above, W/m^2, exact for the interpolation.
  glm::dvec3 horizontal_irradiance() const noexcept;

 private:
  glm::dvec3 pixel(int x, int y) const noexcept;

  ImageF image_;
  DirectionSampler sampler_;
  double scale_ = 1;
};

}  // namespace groundray
