#pragma once

#include <glm/vec3.hpp>

namespace groundray {

/// Clear air between the sun and the ground. The defaults are those of the reference spectra of
/// ASTM G173-03, except for the turbidity: that standard's aerosols (optical depth 0.084 at 500 nm)
/// correspond to 1.7.
struct ClearAir {
  double turbidity = 3;      ///< as in Hosek and Wilkie, Preetham: 1 is pure air, 10 dense haze
  double water_cm = 1.4164;  ///< precipitable water of a vertical column
  double ozone_cm = 0.3438;  ///< ozone of a vertical column, at 0 degrees Celsius and 1 atmosphere
  double pressure_hpa = 1013;  ///< at the ground
};

/// Checks the bounds of `air`.
/// @throws Error listing every field that is out of bounds: turbidity 1 to 10, water 0 to 20 cm,
///         ozone 0 to 1 cm, pressure 100 to 1100 hPa.
void check_air(const ClearAir& air);

/// Returns the air mass: the length of the sun's path through the air relative to a vertical path.
/// It is 1 at the zenith and 38 at and below the horizon.
/// @param elevation_rad  apparent elevation of the sun, in [-pi / 2, pi / 2].
/// @see Kasten and Young, Revised optical air mass tables and approximation formula, Applied Optics
///      28 (1989).
double air_mass(double elevation_rad) noexcept;

/// Returns the spectral irradiance, W/(m^2 nm), of a plane perpendicular to the sun's rays by the
/// sun's disc, at the sun's mean distance. Linear between the 122 wavelengths of the table.
/// @param wavelength_nm  300 to 4000.
/// @param elevation_rad  apparent elevation of the sun.
/// @throws Error if the wavelength or the air is out of bounds.
/// @see docs/theory/sky.md: Bird and Riordan's simple spectral model (1984), direct light.
double direct_irradiance_w_m2_nm(double wavelength_nm, double elevation_rad, const ClearAir& air);

/// Returns the same irradiance in linear sRGB: W/m^2 weighted by the colour matching functions.
/// @throws Error if the air is out of bounds.
glm::dvec3 direct_irradiance_rgb(double elevation_rad, const ClearAir& air);

}  // namespace groundray
