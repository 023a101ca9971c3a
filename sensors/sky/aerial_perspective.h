#pragma once

#include <glm/exponential.hpp>
#include <glm/vec3.hpp>

#include "sensors/sky/atmosphere.h"

namespace groundray {

/// Aerial perspective: attenuation of radiance by the air between a camera and a surface, and the
/// light that this air adds. The air is homogeneous; each channel has the extinction at its own
/// wavelength.
/// @see Koschmieder, Theorie der horizontalen Sichtweite (1924); docs/theory/sky.md.
class AerialPerspective {
 public:
  /// Dominant wavelengths of the sRGB primaries, relative to D65, nm.
  static constexpr glm::dvec3 wavelengths_nm{611.4, 549.1, 464.3};

  /// @param air  spec of the air; a lidar in the same air shares it.
  /// @throws Error as Atmosphere.
  explicit AerialPerspective(const AtmosphereSpec& air)
      : extinction_per_m_(Atmosphere(air, wavelengths_nm.r).extinction_per_m(),
                          Atmosphere(air, wavelengths_nm.g).extinction_per_m(),
                          Atmosphere(air, wavelengths_nm.b).extinction_per_m()) {}

  /// Returns the radiance `from_surface` after attenuation over `distance_m` (finite, >= 0), plus
  /// the radiance that the air adds.
  /// @param from_horizon  radiance of infinitely deep air in the same direction.
  glm::dvec3 through(const glm::dvec3& from_surface, double distance_m,
                     const glm::dvec3& from_horizon) const noexcept {
    const glm::dvec3 left = glm::exp(-extinction_per_m_ * distance_m);
    return from_surface * left + from_horizon * (1.0 - left);
  }

  const glm::dvec3& extinction_per_m() const noexcept { return extinction_per_m_; }

 private:
  glm::dvec3 extinction_per_m_;
};

}  // namespace groundray
