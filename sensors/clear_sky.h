#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "sensors/direction_sampler.h"
#include "sensors/hosek_wilkie.h"

namespace groundray {

/// A clear sky over flat Lambertian ground that reaches to the horizon; the sun's disc is not in
/// it. Immutable, so any number of threads may use one.
class ClearSky {
 public:
  /// @param sun  unit direction to it, axes of W.
  /// @param sun_irradiance  of a plane across its rays, W/m^2: the ground reflects it too.
  /// @throws Error as HosekWilkie.
  ClearSky(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun,
           const glm::dvec3& sun_irradiance);

  /// Returns what comes from a unit direction, linear sRGB, W/(m^2 sr).
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept {
    return direction.z < 0 ? ground_ : model_.radiance(direction);
  }

  /// Draws a direction about in proportion to its luminance. @see DirectionSampler
  DirectionSample sample(const glm::dvec2& uniform) const noexcept {
    return sampler_.sample(uniform);
  }
  double pdf_per_sr(const glm::dvec3& direction) const noexcept {
    return sampler_.pdf_per_sr(direction);
  }

  /// Irradiance of a horizontal plane by the sky, W/m^2, within 5e-5 of it.
  const glm::dvec3& horizontal_irradiance() const noexcept { return irradiance_; }

 private:
  DirectionSampler tabulated() const;

  HosekWilkie model_;
  glm::dvec3 irradiance_;
  glm::dvec3 ground_;
  DirectionSampler sampler_;
};

}  // namespace groundray
