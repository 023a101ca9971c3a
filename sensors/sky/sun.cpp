#include "sensors/sky/sun.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/error.h"

namespace groundray {
namespace {

using std::numbers::pi;

// Radius by Auwers (1891), which The Astronomical Almanac uses: 0.26656 degrees at 1 au.
constexpr double radius_at_1_au_rad = 959.63 / 3600 * pi / 180;

constexpr int limb_powers = 6;
constexpr double limb_darkening[3][limb_powers] = {
#include <sky/limb_darkening.inc>
};

// Returns the means of the channels' polynomials over the projected disc. The mean of mu^j is
// 2 / (j + 2), because equal areas are equal steps of mu^2.
glm::dvec3 mean_darkening() {
  glm::dvec3 mean(0);
  for (glm::length_t channel = 0; channel < 3; ++channel) {
    for (int j = 0; j < limb_powers; ++j) mean[channel] += limb_darkening[channel][j] * 2 / (j + 2);
  }
  return mean;
}

// Returns each channel's radiance over its mean on the projected disc; mu is the cosine of the
// angle of emission.
glm::dvec3 relative_radiance(double mu) {
  static const glm::dvec3 mean = mean_darkening();
  glm::dvec3 here(0);
  for (glm::length_t channel = 0; channel < 3; ++channel) {
    double power = 1;
    for (int j = 0; j < limb_powers; ++j, power *= mu)
      here[channel] += limb_darkening[channel][j] * power;
  }
  return here / mean;
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
  const double sine = std::sin(radius_rad / 2);
  return 2 * sine * sine;
}

}  // namespace

Sun::Sun(const SunSpec& spec, const ClearAir& air) : air_(air), disc_(spec.disc) {
  check_air(air);
  const SunPosition position = position_of(spec, air);
  direction_ = position.direction;
  distance_au_ = position.distance_au;
  elevation_rad_ = std::atan2(direction_.z, std::hypot(direction_.x, direction_.y));
  radius_rad_ = std::asin(std::sin(radius_at_1_au_rad) / distance_au_);
  if (is_up()) {
    irradiance_ = direct_irradiance_rgb(elevation_rad(), air_) / (distance_au_ * distance_au_);
  }
  const glm::dvec3 aside = std::abs(direction_.z) < 0.5 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  across_ = glm::normalize(glm::cross(aside, direction_));
  up_ = glm::cross(direction_, across_);
  depth_ = disc_depth(radius_rad_);
  rim_squared_ = std::sin(radius_rad_) * std::sin(radius_rad_);
  // On a plane perpendicular to the rays, the disc has the cosine-weighted solid angle pi sin^2.
  mean_radiance_ = irradiance_ / (pi * rim_squared_);
}

double Sun::solid_angle_sr() const noexcept { return 2 * pi * depth_; }

glm::dvec3 Sun::radiance(const glm::dvec3& direction) const noexcept {
  const double depth = versine(direction, direction_);
  if (!is_up() || depth > depth_) return glm::dvec3(0);
  if (disc_ == SunDisc::Uniform) return mean_radiance_;
  const double off_center = depth * (2 - depth) / rim_squared_;  // sin^2 over that of the limb
  return mean_radiance_ * relative_radiance(std::sqrt(std::max(1 - off_center, 0.0)));
}

DirectionSample Sun::sample(const glm::dvec2& uniform) const noexcept {
  if (!is_up()) return {direction_, 0};
  const double depth = uniform.x * depth_;
  const double sine = std::sqrt(depth * (2 - depth));
  const double turn = 2 * pi * uniform.y;
  return {(1 - depth) * direction_ + sine * (std::cos(turn) * across_ + std::sin(turn) * up_),
          1 / solid_angle_sr()};
}

double Sun::pdf_per_sr(const glm::dvec3& direction) const noexcept {
  if (!is_up() || versine(direction, direction_) > depth_) return 0;
  return 1 / solid_angle_sr();
}

double solar_irradiance_w_m2_nm(const Sun& sun, double wavelength_nm) {
  const double at_1_au = direct_irradiance_w_m2_nm(wavelength_nm, sun.elevation_rad(), sun.air());
  return sun.is_up() ? at_1_au / (sun.distance_au() * sun.distance_au()) : 0;
}

}  // namespace groundray
