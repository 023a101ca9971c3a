#pragma once

#include <chrono>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "sensors/sky/direction_sampler.h"
#include "sensors/sky/solar_spectrum.h"
#include "sensors/sky/sun_position.h"

namespace groundray {

/// Fixed apparent position of the sun.
struct SunAngles {
  double azimuth_deg = 180;  ///< clockwise from north
  double elevation_deg = 45;
  double distance_au = 1;
};

/// Sun at a time and location. The air's pressure is that of the sky's ClearAir.
struct SunTime {
  std::chrono::sys_time<std::chrono::milliseconds> utc{};
  double latitude_deg = 0;   ///< geographic, north positive
  double longitude_deg = 0;  ///< east positive
  double temperature_c = 15;
};

/// Radiance of the sun's disc from its centre to its limb.
enum class SunDisc { Uniform, LimbDarkened };

/// Sun of a scene.
struct SunSpec {
  std::variant<SunAngles, SunTime> position;
  SunDisc disc = SunDisc::LimbDarkened;
};

/// Sun's disc through clear air. It shines while its upper limb is above the horizon and is dark
/// below. Immutable and therefore thread-safe.
class Sun {
 public:
  /// @throws Error listing all values that are out of bounds in `spec` and `air`.
  Sun(const SunSpec& spec, const ClearAir& air);

  /// Returns the unit vector to the centre of the disc, axes of W (east, north, up).
  const glm::dvec3& direction() const noexcept { return direction_; }
  double elevation_rad() const noexcept { return elevation_rad_; }
  double angular_radius_rad() const noexcept { return radius_rad_; }
  double solid_angle_sr() const noexcept;
  bool is_up() const noexcept { return elevation_rad_ > -radius_rad_; }

  /// Returns the irradiance of a plane perpendicular to the sun's rays, linear sRGB, W/m^2; see
  /// docs/theory/sky.md for the unit.
  const glm::dvec3& irradiance() const noexcept { return irradiance_; }

  /// Returns the radiance from a unit direction, W/(m^2 sr); 0 outside the disc.
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

  /// Draws a direction to the disc, uniformly in solid angle; its density is 0 if the sun is not
  /// up.
  /// @param uniform  two independent numbers in [0, 1).
  DirectionSample sample(const glm::dvec2& uniform) const noexcept;
  /// Returns the density, 1/sr, with which `sample` draws a unit direction.
  double pdf_per_sr(const glm::dvec3& direction) const noexcept;

  const ClearAir& air() const noexcept { return air_; }
  double distance_au() const noexcept { return distance_au_; }

 private:
  ClearAir air_;
  glm::dvec3 direction_;
  double distance_au_;
  double elevation_rad_;
  double radius_rad_;
  glm::dvec3 irradiance_{0};
  SunDisc disc_;
  glm::dvec3 across_, up_;    // axes of the disc, perpendicular to direction_
  double depth_;              // 1 - cos of the disc's radius
  double rim_squared_;        // sin^2 of the disc's radius
  glm::dvec3 mean_radiance_;  // over the projected disc
};

/// Returns the spectral irradiance, W/(m^2 nm), of a plane perpendicular to the sun's rays, for a
/// SolarBackground with the sun's direction; 0 if the sun is not up.
/// @throws Error unless the wavelength is in [300, 4000] nm.
double solar_irradiance_w_m2_nm(const Sun& sun, double wavelength_nm);

}  // namespace groundray
