#pragma once

#include <glm/vec3.hpp>
#include <limits>

#include "core/math.h"

namespace groundray {

/// Model of the exponent of wavelength in haze's extinction: Kruse (1962), or Kim (2001). They
/// differ below a visibility of 6 km; below 0.5 km, Kim's model attenuates all wavelengths equally.
enum class HazeLaw { Kruse, Kim };

/// Air between a lidar and the ground, homogeneous. The default is a vacuum.
struct AtmosphereSpec {
  static constexpr double none = std::numeric_limits<double>::infinity();
  double visibility_m = none;  ///< range of 2 % contrast at 550 nm; infinite: no haze
  HazeLaw haze_law = HazeLaw::Kim;
  double fog_range_m = none;  ///< meteorological optical range: 5 % contrast; infinite: no fog
  double rain_mm_h = 0;
  double backscatter_per_m_sr = 0;  ///< coefficient of haze or rain, added to that of fog
  double group_index = 1;  ///< group index of the air: c / group velocity (air_group_index)
};

/// Air with haze, fog and rain at one wavelength. Immutable and therefore thread-safe.
/// @see docs/theory/lidar_atmosphere.md: formulas, their sources and limits.
class Atmosphere {
 public:
  /// @param wavelength_nm  wavelength of the laser, 400 to 2000.
  /// @throws Error listing every field of `spec` that is out of bounds.
  Atmosphere(const AtmosphereSpec& spec, double wavelength_nm);

  /// Returns the one-way transmission over `range_m` metres (Beer-Lambert).
  double transmission(double range_m) const noexcept;

  double extinction_per_m() const noexcept { return extinction_per_m_; }
  double backscatter_per_m_sr() const noexcept { return backscatter_per_m_sr_; }
  double group_index() const noexcept { return group_index_; }

 private:
  double extinction_per_m_;
  double backscatter_per_m_sr_;
  double group_index_;
};

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
    const glm::dvec3 left = math::exp(-extinction_per_m_ * distance_m);
    return from_surface * left + from_horizon * (1.0 - left);
  }

  const glm::dvec3& extinction_per_m() const noexcept { return extinction_per_m_; }

 private:
  glm::dvec3 extinction_per_m_;
};

/// Returns the extinction of haze, 1/m, at a visibility V: (3.912 / V) (wavelength / 550 nm)^-q.
double haze_extinction_per_m(double visibility_m, double wavelength_nm, HazeLaw law) noexcept;

/// Returns the extinction of fog, 1/m, at any wavelength: ln 20 / range.
double fog_extinction_per_m(double fog_range_m) noexcept;

/// Returns the backscatter coefficient of fog, 1/(m sr): 0.046 / range.
double fog_backscatter_per_m_sr(double fog_range_m) noexcept;

/// Returns the extinction of rain, 1/m, at any wavelength: 1.076 R^0.67 dB/km at the rate R.
double rain_extinction_per_m(double rain_mm_h) noexcept;

/// Returns the group index of dry air with 0.0375 % CO2, accurate to 1e-6. Saturation with water
/// vapour reduces it by 0.9e-6 at 20 degrees Celsius.
/// @param wavelength_nm  in vacuum, 300 to 1700.
/// @param temperature_c  -40 to 100 degrees Celsius.
/// @param pressure_pa  10 000 to 140 000.
/// @throws Error if an argument is out of bounds.
/// @see Rueger, Refractive indices of light, infrared and radio waves in the atmosphere (2002), the
///      closed formula of IUGG resolution 3 (1999).
double air_group_index(double wavelength_nm, double temperature_c, double pressure_pa);

}  // namespace groundray
