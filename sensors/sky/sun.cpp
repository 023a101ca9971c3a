#include "sensors/sky/sun.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/error.h"
#include "core/math.h"

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
  const double center_deg = (1.914602 - (0.004817 + 0.000014 * t) * t) * math::sin(anomaly) +
                            (0.019993 - 0.000101 * t) * math::sin(2 * anomaly) +
                            0.000289 * math::sin(3 * anomaly);
  const double node = glm::radians(125.04 - 1934.136 * t);
  const double nutation_deg = -0.00478 * math::sin(node);
  const double longitude =
      glm::radians(mean_longitude_deg + center_deg - 0.00569 + nutation_deg);  // with aberration
  const double obliquity = glm::radians(23.4392911 - 0.0130042 * t + 0.00256 * math::cos(node));
  const double distance_au = 1.000001018 * (1 - eccentricity * eccentricity) /
                             (1 + eccentricity * math::cos(anomaly + glm::radians(center_deg)));
  const double sine = math::sin(longitude);
  return {{math::cos(longitude), sine * math::cos(obliquity), sine * math::sin(obliquity)},
          distance_au,
          nutation_deg * math::cos(obliquity)};
}

struct Row {
  double wavelength_nm;
  double irradiance_w_m2_nm;
  double water, ozone, mixed;  // absorption coefficients
  double rgb_nm[3];
};
constexpr Row spectrum_table[] = {
#include <sky/solar_spectrum.inc>
};

// Returns the air mass of an ozone layer at a height of 22 km: Bird and Riordan, equation 2-10.
double ozone_mass(double elevation_rad) {
  constexpr double height = 22.0 / 6370;
  const double sine = std::max(math::sin(elevation_rad), 0.0);
  return (1 + height) / std::sqrt(sine * sine + 2 * height);
}

// Transmission of the air at a row's wavelength: Bird and Riordan, section 2.
class Transmission {
 public:
  Transmission(double elevation_rad, const ClearAir& air)
      : mass_(air_mass(elevation_rad)),
        pressure_mass_(mass_ * air.pressure_hpa / 1013),
        water_(air.water_cm * mass_),
        ozone_(air.ozone_cm * ozone_mass(elevation_rad)),
        // Preetham, Shirley and Smits, A practical analytic model for daylight (1999), appendix 1.
        aerosol_(mass_ * std::max(0.04608 * air.turbidity - 0.04586, 0.0)) {}

  double of(const Row& row) const {
    const double um = row.wavelength_nm / 1000, um2 = um * um;
    const double rayleigh = pressure_mass_ / (um2 * um2 * (115.6406 - 1.3366 / um2));
    const double aerosol = aerosol_ * math::pow(um, -1.3);
    const double water = row.water * water_;
    const double mixed = row.mixed * pressure_mass_;
    return math::exp(-rayleigh - aerosol - row.ozone * ozone_ -
                     0.2385 * water / math::pow(1 + 20.07 * water, 0.45) -
                     1.41 * mixed / math::pow(1 + 118.3 * mixed, 0.45));
  }

 private:
  double mass_;
  double pressure_mass_;
  double water_;
  double ozone_;
  double aerosol_;
};

// Radius by Auwers (1891), which The Astronomical Almanac uses: 0.26656 degrees at 1 au.
constexpr double radius_at_1_au_rad = 959.63 / 3600 * pi / 180;

constexpr int limb_powers = 6;
constexpr double limb_darkening[3][limb_powers] = {
#include <sky/limb_darkening.inc>
};

// Returns the coefficients of each channel's radiance over its mean on the projected disc, in
// powers of the cosine mu of the angle of emission. The mean of mu^j is 2 / (j + 2), because equal
// areas are equal steps of mu^2.
std::array<glm::dvec3, limb_powers> relative_limb(SunDisc disc) {
  std::array<glm::dvec3, limb_powers> limb{};
  if (disc == SunDisc::Uniform) {
    limb[0] = glm::dvec3(1);
    return limb;
  }
  for (glm::length_t channel = 0; channel < 3; ++channel) {
    double mean = 0;
    for (int j = 0; j < limb_powers; ++j) mean += limb_darkening[channel][j] * 2 / (j + 2);
    for (int j = 0; j < limb_powers; ++j)
      limb[static_cast<std::size_t>(j)][channel] = limb_darkening[channel][j] / mean;
  }
  return limb;
}

SunPosition position_of(const SunSpec& spec, const ClearAir& air) {
  if (const auto* time = std::get_if<SunTime>(&spec.position)) {
    return sun_position(time->utc, {time->latitude_deg, time->longitude_deg, air.pressure_hpa,
                                    time->temperature_c});
  }
  const auto& angles = std::get<SunAngles>(spec.position);
  Violations broken("SunAngles");
  broken.unless(std::isfinite(angles.azimuth_deg), "azimuth_deg = {} must be finite",
                angles.azimuth_deg);
  broken.unless(std::abs(angles.elevation_deg) <= 90, "elevation_deg = {} must be in [-90, 90]",
                angles.elevation_deg);
  broken.unless(angles.distance_au > 0.9 && angles.distance_au < 1.1,
                "distance_au = {} must be in (0.9, 1.1): the Earth's is 0.983 to 1.017",
                angles.distance_au);
  broken.throw_if_any();
  return {direction_of(glm::radians(angles.azimuth_deg), glm::radians(angles.elevation_deg)),
          angles.distance_au};
}

// Returns 1 - cos(angle) between unit vectors, without cancellation.
double versine(const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 chord = a - b;
  return glm::dot(chord, chord) / 2;
}

double disc_depth(double radius_rad) {  // 1 - cos
  const double sine = math::sin(radius_rad / 2);
  return 2 * sine * sine;
}

}  // namespace

double refraction_rad(double elevation_rad, double pressure_hpa, double temperature_c) noexcept {
  const double degrees = glm::degrees(elevation_rad);
  if (degrees < -1) return 0;
  const double arc_minutes = 1.02 / math::tan(glm::radians(degrees + 10.3 / (degrees + 5.11)));
  return glm::radians(arc_minutes / 60 * (pressure_hpa / 1010) * (283 / (273 + temperature_c)));
}

glm::dvec3 direction_of(double azimuth_rad, double elevation_rad) noexcept {
  const double level = math::cos(elevation_rad);
  return {level * math::sin(azimuth_rad), level * math::cos(azimuth_rad), math::sin(elevation_rad)};
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
  const double x = s.x * math::cos(meridian) + s.y * math::sin(meridian);
  const double y = s.y * math::cos(meridian) - s.x * math::sin(meridian);
  const double north = math::cos(latitude) * s.z - math::sin(latitude) * x;
  const double up = math::cos(latitude) * x + math::sin(latitude) * s.z -
                    math::sin(glm::radians(parallax_deg)) / sun.distance_au;
  const double elevation = math::atan2(up, math::hypot(y, north));
  const double lift = refraction_rad(elevation, place.pressure_hpa, place.temperature_c);
  return {direction_of(math::atan2(y, north), std::min(elevation + lift, pi / 2)), sun.distance_au};
}

void check_air(const ClearAir& air) {
  Violations broken("ClearAir");
  broken.unless(air.turbidity >= 1 && air.turbidity <= 10, "turbidity = {} must be in [1, 10]",
                air.turbidity);
  broken.unless(air.water_cm >= 0 && air.water_cm <= 20,
                "water_cm = {} must be in [0, 20]: is it in millimetres?", air.water_cm);
  broken.unless(air.ozone_cm >= 0 && air.ozone_cm <= 1,
                "ozone_cm = {} must be in [0, 1]: is it in Dobson units (1/1000 cm)?",
                air.ozone_cm);
  broken.unless(air.pressure_hpa >= 100 && air.pressure_hpa <= 1100,
                "pressure_hpa = {} must be in [100, 1100]: is it in Pa?", air.pressure_hpa);
  broken.throw_if_any();
}

double air_mass(double elevation_rad) noexcept {
  const double degrees = std::max(glm::degrees(elevation_rad), 0.0);
  return 1 / (math::sin(glm::radians(degrees)) + 0.50572 * math::pow(degrees + 6.07995, -1.6364));
}

double direct_irradiance_w_m2_nm(double wavelength_nm, double elevation_rad, const ClearAir& air) {
  check_air(air);
  const Row& first = *std::begin(spectrum_table);
  const Row& last = *(std::end(spectrum_table) - 1);
  if (!(wavelength_nm >= first.wavelength_nm && wavelength_nm <= last.wavelength_nm)) {
    throw Error("Sunlight: wavelength {} nm must be in [{}, {}]", wavelength_nm,
                first.wavelength_nm, last.wavelength_nm);
  }
  const Row* above =
      std::ranges::lower_bound(std::begin(spectrum_table) + 1, std::end(spectrum_table),
                               wavelength_nm, {}, &Row::wavelength_nm);
  const Row* below = above - 1;
  const Transmission transmission(elevation_rad, air);
  const auto irradiance = [&](const Row& row) {
    return row.irradiance_w_m2_nm * transmission.of(row);
  };
  return glm::mix(
      irradiance(*below), irradiance(*above),
      (wavelength_nm - below->wavelength_nm) / (above->wavelength_nm - below->wavelength_nm));
}

glm::dvec3 direct_irradiance_rgb(double elevation_rad, const ClearAir& air) {
  check_air(air);
  const Transmission transmission(elevation_rad, air);
  glm::dvec3 sum(0);
  for (const Row& row : spectrum_table) {
    sum += row.irradiance_w_m2_nm * transmission.of(row) *
           glm::dvec3(row.rgb_nm[0], row.rgb_nm[1], row.rgb_nm[2]);
  }
  return glm::max(sum, glm::dvec3(0));  // the reddest light near the horizon is outside sRGB
}

Sun::Sun(const SunSpec& spec, const ClearAir& air, double transmittance)
    : air_(air), transmittance_(transmittance) {
  check_air(air);
  const SunPosition position = position_of(spec, air);
  direction_ = position.direction;
  distance_au_ = position.distance_au;
  elevation_rad_ = math::atan2(direction_.z, math::hypot(direction_.x, direction_.y));
  radius_rad_ = math::asin(math::sin(radius_at_1_au_rad) / distance_au_);
  if (is_up()) {
    irradiance_ = transmittance * direct_irradiance_rgb(elevation_rad(), air_) /
                  (distance_au_ * distance_au_);
  }
  const glm::dvec3 aside = std::abs(direction_.z) < 0.5 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  across_ = glm::normalize(glm::cross(aside, direction_));
  up_ = glm::cross(direction_, across_);
  depth_ = disc_depth(radius_rad_);
  rim_squared_ = math::sin(radius_rad_) * math::sin(radius_rad_);
  // On a plane perpendicular to the rays, the disc has the cosine-weighted solid angle pi sin^2.
  limb_ = relative_limb(spec.disc);
  for (glm::dvec3& power : limb_) power *= irradiance_ / (pi * rim_squared_);
}

double Sun::solid_angle_sr() const noexcept { return 2 * pi * depth_; }

glm::dvec3 Sun::radiance(const glm::dvec3& direction) const noexcept {
  const double depth = versine(direction, direction_);
  if (!is_up() || depth > depth_) return glm::dvec3(0);
  return disc_radiance(depth * (2 - depth));
}

DirectionSample Sun::sample(const glm::dvec2& uniform) const noexcept {
  if (!is_up()) return {direction_, 0};
  return {draw(uniform).direction, 1 / solid_angle_sr()};
}

double Sun::pdf_per_sr(const glm::dvec3& direction) const noexcept {
  if (!is_up() || versine(direction, direction_) > depth_) return 0;
  return 1 / solid_angle_sr();
}

double solar_irradiance_w_m2_nm(const Sun& sun, double wavelength_nm) {
  const double at_1_au = direct_irradiance_w_m2_nm(wavelength_nm, sun.elevation_rad(), sun.air());
  return sun.is_up() ? sun.transmittance() * at_1_au / (sun.distance_au() * sun.distance_au()) : 0;
}

}  // namespace groundray
