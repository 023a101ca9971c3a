#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "sensors/sky/direction_sampler.h"
#include "sensors/sky/hosek_wilkie.h"

namespace groundray {

/// Clear sky above flat Lambertian ground that extends to the horizon, without the sun's disc.
/// Immutable and therefore thread-safe.
class ClearSky {
 public:
  /// @param sun  unit direction to the sun, axes of W.
  /// @param sun_irradiance  irradiance of a plane perpendicular to the sun's rays, W/m^2; the
  ///        ground reflects it too.
  /// @throws Error as HosekWilkie.
  ClearSky(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun,
           const glm::dvec3& sun_irradiance);

  /// Returns the radiance from a unit direction (axes of W), linear sRGB, W/(m^2 sr).
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept {
    return direction.z < 0 ? ground_ : model_.radiance(direction);
  }

  /// Draws a direction approximately in proportion to its luminance. @see DirectionSampler
  DirectionSample sample(const glm::dvec2& uniform) const noexcept {
    return sampler_.sample(uniform);
  }
  double pdf_per_sr(const glm::dvec3& direction) const noexcept {
    return sampler_.pdf_per_sr(direction);
  }

  /// Returns the irradiance of a horizontal plane by the sky, W/m^2, accurate to 5e-5 of it.
  const glm::dvec3& horizontal_irradiance() const noexcept { return irradiance_; }

 private:
  DirectionSampler tabulated() const;

  HosekWilkie model_;
  glm::dvec3 irradiance_;
  glm::dvec3 ground_;
  DirectionSampler sampler_;
};

}  // namespace groundray
