#pragma once

#include <chrono>
#include <glm/vec3.hpp>

namespace groundray {

/// Location on the Earth and the air there.
struct Place {
  double latitude_deg = 0;     ///< geographic, north positive
  double longitude_deg = 0;    ///< east positive
  double pressure_hpa = 1013;  ///< determines refraction; 0 for none
  double temperature_c = 15;   ///< degrees Celsius
};

/// Apparent position of the sun.
struct SunPosition {
  glm::dvec3 direction{0, 0, 1};  ///< unit vector to the centre of its disc, axes of W
  double distance_au = 1;
};

/// Returns the refraction, rad: the apparent elevation of a light minus its elevation without air;
/// 0 below -1 degree.
/// @param elevation_rad  elevation without air.
/// @see Saemundsson, Atmospheric refraction, Sky and Telescope 72 (1986).
double refraction_rad(double elevation_rad, double pressure_hpa, double temperature_c) noexcept;

/// Returns the apparent position of the sun. The error is at most 0.01 degrees from 1990 to 2040
/// (0.0036 root mean square), plus that of taking UTC as universal time, at most 0.9 s or 0.004
/// degrees. Near the horizon real refraction varies by more. W's north is taken as true north.
/// @throws Error if the location, or the year (1900 to 2100), is out of bounds.
/// @see Meeus, Astronomical Algorithms, 2nd ed. (1998), chapters 12, 13 and 25: low accuracy.
SunPosition sun_position(std::chrono::sys_time<std::chrono::milliseconds> utc, const Place& place);

/// Returns the unit direction, axes of W, of an azimuth (clockwise from north) and an elevation.
glm::dvec3 direction_of(double azimuth_rad, double elevation_rad) noexcept;

}  // namespace groundray
