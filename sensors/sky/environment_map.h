#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "core/image/image.h"
#include "sensors/sky/direction_sampler.h"

namespace groundray {

/// Scale by a factor: radiance, W/(m^2 sr), of a pixel value of 1.
struct RadianceScale {
  double factor = 1;
};
/// Scale by which a horizontal plane receives this illuminance from above.
struct IlluminanceScale {
  double lux = 0;
};
/// Scale of an image's values.
using EnvironmentScale = std::variant<RadianceScale, IlluminanceScale>;

/// Radiance from every direction, given by an equirectangular image: linear sRGB, W/(m^2 sr), each
/// channel weighted by its colour matching function. Immutable and therefore thread-safe. Takes 24
/// bytes per pixel of three channels.
class EnvironmentMap {
 public:
  /// @param image  1 channel (grey) or 3 (R, G, B), optionally with alpha, which is ignored; laid
  ///        out as defined by LatLongGrid.
  /// @param center_azimuth_rad  azimuth of the image's middle, clockwise from north.
  /// @throws Error naming pixels that are NaN, infinite or negative, or reporting an image without
  ///         light or any other value that is out of bounds.
  EnvironmentMap(ImageF image, double center_azimuth_rad, const EnvironmentScale& scale);

  /// Returns the radiance from a unit direction (axes of W: east, north, up), bilinear.
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

  /// Draws a direction approximately in proportion to its luminance. @see DirectionSampler
  DirectionSample sample(const glm::dvec2& uniform) const noexcept {
    return sampler_.sample(uniform);
  }
  double pdf_per_sr(const glm::dvec3& direction) const noexcept {
    return sampler_.pdf_per_sr(direction);
  }

  /// Returns the irradiance of a horizontal plane from above, W/m^2: the exact integral of the
  /// interpolated image.
  glm::dvec3 horizontal_irradiance() const noexcept;

 private:
  glm::dvec3 pixel(int x, int y) const noexcept;

  ImageF image_;
  DirectionSampler sampler_;
  double scale_ = 1;
};

}  // namespace groundray
