#pragma once

#include <chrono>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "sensors/direction_sampler.h"
#include "sensors/solar_spectrum.h"
#include "sensors/sun_position.h"

namespace groundray {

/// A sun that stands still, as seen.
struct SunAngles {
  double azimuth_deg = 180;  ///< clockwise from north
  double elevation_deg = 45;
  double distance_au = 1;
};

/// The sun of a time and place. The air's pressure is that of the sky's ClearAir.
struct SunTime {
  std::chrono::sys_time<std::chrono::milliseconds> utc{};
  double latitude_deg = 0;   ///< geographic, north positive
  double longitude_deg = 0;  ///< east positive
  double temperature_c = 15;
};

/// How bright the sun's disc is from its middle to its limb.
enum class SunDisc { Uniform, LimbDarkened };

/// The sun of a scene.
struct SunSpec {
  std::variant<SunAngles, SunTime> position;
  SunDisc disc = SunDisc::LimbDarkened;
};

/// The sun's disc through clear air. It shines while its upper limb is above the horizon; lower it
/// is dark. Immutable, so any number of threads may use one.
class Sun {
 public:
  /// @throws Error listing what is out of bounds in `spec` and `air`.
  Sun(const SunSpec& spec, const ClearAir& air);

  /// To the centre of the disc, unit, axes of W (east, north, up).
  const glm::dvec3& direction() const noexcept { return direction_; }
  double elevation_rad() const noexcept { return elevation_rad_; }
  double angular_radius_rad() const noexcept { return radius_rad_; }
  double solid_angle_sr() const noexcept;
  bool is_up() const noexcept { return elevation_rad_ > -radius_rad_; }

  /// Irradiance of a plane across its rays, linear sRGB, W/m^2; see docs/sky.md for the unit.
  const glm::dvec3& irradiance() const noexcept { return irradiance_; }

  /// Returns what comes from a unit direction: 0 outside of the disc. W/(m^2 sr).
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

  /// Draws a direction to the disc, uniform in solid angle; of density 0 if the sun is not up.
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
  glm::dvec3 across_, up_;    // with the direction, axes of the disc
  double depth_;              // of the disc: 1 - cos of its radius
  double rim_squared_;        // sin^2 of it
  glm::dvec3 mean_radiance_;  // over the disc as it looks
};

/// Returns the irradiance, W/(m^2 nm), that the sun gives a plane across its rays, as
/// SolarBackground wants it with the sun's direction. 0 if the sun is not up.
/// @throws Error unless the wavelength is in [300, 4000] nm.
double solar_irradiance_w_m2_nm(const Sun& sun, double wavelength_nm);

}  // namespace groundray
