#pragma once

#include <glm/exponential.hpp>
#include <glm/vec3.hpp>

#include "sensors/atmosphere.h"

namespace groundray {

/// How air between a camera and what it sees fades it into the horizon: homogeneous, each channel
/// by the extinction at its colour. @see Koschmieder, Theorie der horizontalen Sichtweite (1924).
class AerialPerspective {
 public:
  /// The dominant wavelengths of the sRGB primaries, against D65, nm.
  static constexpr glm::dvec3 wavelengths_nm{611.4, 549.1, 464.3};

  /// @throws Error as Atmosphere; a lidar in the same air shares its AtmosphereSpec.
  explicit AerialPerspective(const AtmosphereSpec& air)
      : extinction_per_m_(Atmosphere(air, wavelengths_nm.r).extinction_per_m(),
                          Atmosphere(air, wavelengths_nm.g).extinction_per_m(),
                          Atmosphere(air, wavelengths_nm.b).extinction_per_m()) {}

  /// Returns what is left of radiance `from_surface` after `distance_m` (finite, >= 0), and what
  /// the air adds to it. @param from_horizon  what air of endless depth shines with, that way.
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
