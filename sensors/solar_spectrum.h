#pragma once

#include <glm/vec3.hpp>

namespace groundray {

/// Clear air between the sun and the ground. The defaults are those of the reference spectra of
/// ASTM G173-03, but for the turbidity: that standard's aerosols (0.084 at 500 nm) are 1.7.
struct ClearAir {
  double turbidity = 3;        ///< of Hosek and Wilkie, Preetham: 1 is pure air, 10 dense haze
  double water_cm = 1.4164;    ///< precipitable water of a vertical column
  double ozone_cm = 0.3438;    ///< of a vertical column, at 0 degrees Celsius and 1 atmosphere
  double pressure_hpa = 1013;  ///< at the ground
};

/// @throws Error listing every field of `air` that is out of bounds: turbidity 1 to 10, water 0 to
///         20 cm, ozone 0 to 1 cm, pressure 100 to 1100 hPa.
void check_air(const ClearAir& air);

/// Returns the length of the sun's way through the air in vertical ones: 1 at the zenith, 38 at the
/// horizon, and below it as at the horizon.
/// @param elevation_rad  of the sun as seen, in [-pi / 2, pi / 2].
/// @see Kasten and Young, Revised optical air mass tables and approximation formula, Applied
///      Optics 28 (1989).
double air_mass(double elevation_rad) noexcept;

/// Returns the irradiance, W/(m^2 nm), that the sun's disc gives a plane across its rays, at the
/// sun's mean distance. Linear between the 122 wavelengths of the table.
/// @param wavelength_nm  300 to 4000.
/// @param elevation_rad  of the sun as seen.
/// @throws Error if the wavelength or the air is out of bounds.
/// @see docs/sky.md: Bird and Riordan's simple spectral model (1984), direct light.
double direct_irradiance_w_m2_nm(double wavelength_nm, double elevation_rad, const ClearAir& air);

/// Returns the same summed up to linear sRGB, W/m^2 weighed by the eye's colour matching functions.
/// @throws Error if the air is out of bounds.
glm::dvec3 direct_irradiance_rgb(double elevation_rad, const ClearAir& air);

}  // namespace groundray
