#include "sensors/sky/sun_position.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/error.h"

namespace groundray {
namespace {

using Time = std::chrono::sys_time<std::chrono::milliseconds>;
using Days = std::chrono::duration<double, std::chrono::days::period>;

using std::numbers::pi;
constexpr double days_per_century = 36525;
// Terrestrial minus universal time: 57 s in 1990, 69 s in 2020 (Espenak and Meeus). The sun moves
// by 0.0001 degrees in 10 s.
constexpr double delta_t_s = 69;
constexpr double parallax_deg = 8.794 / 3600;  // horizontal parallax of the sun at 1 au

void check_time_and_place(Time utc, const Place& place) {
  const std::chrono::year_month_day date(std::chrono::floor<std::chrono::days>(utc));
  Violations broken("Sun");
  broken.unless(date.year() >= std::chrono::year(1900) && date.year() <= std::chrono::year(2100),
                "the year {} must be in [1900, 2100]", static_cast<int>(date.year()));
  broken.unless(std::abs(place.latitude_deg) <= 90, "latitude_deg = {} must be in [-90, 90]",
                place.latitude_deg);
  broken.unless(std::abs(place.longitude_deg) <= 360, "longitude_deg = {} must be in [-360, 360]",
                place.longitude_deg);
  broken.unless(place.pressure_hpa >= 0 && place.pressure_hpa <= 1100,
                "pressure_hpa = {} must be in [0, 1100]: is it in Pa?", place.pressure_hpa);
  broken.unless(place.temperature_c > -100 && place.temperature_c < 100,
                "temperature_c = {} must be in (-100, 100): is it in K?", place.temperature_c);
  broken.throw_if_any();
}

// Sun as seen from the Earth's centre, in the equatorial frame of date.
struct Geocentric {
  glm::dvec3 direction;
  double distance_au;
  double nutation_deg;  // nutation of the equinox, along the equator
};

Geocentric geocentric_sun(double t) {  // centuries of terrestrial time since J2000
  const double mean_longitude_deg = 280.46646 + (36000.76983 + 0.0003032 * t) * t;
  const double anomaly = glm::radians(357.52911 + (35999.05029 - 0.0001537 * t) * t);
  const double eccentricity = 0.016708634 - (0.000042037 + 0.0000001267 * t) * t;
  const double center_deg = (1.914602 - (0.004817 + 0.000014 * t) * t) * std::sin(anomaly) +
                            (0.019993 - 0.000101 * t) * std::sin(2 * anomaly) +
                            0.000289 * std::sin(3 * anomaly);
  const double node = glm::radians(125.04 - 1934.136 * t);
  const double nutation_deg = -0.00478 * std::sin(node);
  const double longitude =
      glm::radians(mean_longitude_deg + center_deg - 0.00569 + nutation_deg);  // with aberration
  const double obliquity = glm::radians(23.4392911 - 0.0130042 * t + 0.00256 * std::cos(node));
  const double distance_au = 1.000001018 * (1 - eccentricity * eccentricity) /
                             (1 + eccentricity * std::cos(anomaly + glm::radians(center_deg)));
  const double sine = std::sin(longitude);
  return {{std::cos(longitude), sine * std::cos(obliquity), sine * std::sin(obliquity)},
          distance_au,
          nutation_deg * std::cos(obliquity)};
}

}  // namespace

double refraction_rad(double elevation_rad, double pressure_hpa, double temperature_c) noexcept {
  const double degrees = glm::degrees(elevation_rad);
  if (degrees < -1) return 0;
  const double arc_minutes = 1.02 / std::tan(glm::radians(degrees + 10.3 / (degrees + 5.11)));
  return glm::radians(arc_minutes / 60 * (pressure_hpa / 1010) * (283 / (273 + temperature_c)));
}

glm::dvec3 direction_of(double azimuth_rad, double elevation_rad) noexcept {
  const double level = std::cos(elevation_rad);
  return {level * std::sin(azimuth_rad), level * std::cos(azimuth_rad), std::sin(elevation_rad)};
}

SunPosition sun_position(Time utc, const Place& place) {
  check_time_and_place(utc, place);
  constexpr auto noon_of_j2000 =
      std::chrono::sys_days(std::chrono::year(2000) / 1 / 1) + std::chrono::hours(12);
  const double days = std::chrono::duration_cast<Days>(utc - noon_of_j2000).count();
  const double centuries = days / days_per_century;
  const Geocentric sun = geocentric_sun(centuries + delta_t_s / (86400 * days_per_century));
  const double sidereal_deg = 280.46061837 + 360.98564736629 * days +
                              0.000387933 * centuries * centuries + sun.nutation_deg;
  const double meridian = glm::radians(std::fmod(sidereal_deg, 360) + place.longitude_deg);
  const double latitude = glm::radians(place.latitude_deg);
  // Axes: x towards the intersection of the local meridian and the equator, y east, z along the
  // Earth's axis.
  const glm::dvec3& s = sun.direction;
  const double x = s.x * std::cos(meridian) + s.y * std::sin(meridian);
  const double y = s.y * std::cos(meridian) - s.x * std::sin(meridian);
  const double north = std::cos(latitude) * s.z - std::sin(latitude) * x;
  const double up = std::cos(latitude) * x + std::sin(latitude) * s.z -
                    std::sin(glm::radians(parallax_deg)) / sun.distance_au;
  const double elevation = std::atan2(up, std::hypot(y, north));
  const double lift = refraction_rad(elevation, place.pressure_hpa, place.temperature_c);
  return {direction_of(std::atan2(y, north), std::min(elevation + lift, pi / 2)), sun.distance_au};
}

}  // namespace groundray
