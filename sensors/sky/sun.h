#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "core/elementary.h"
#include "core/pack.h"
#include "sensors/sky/direction_sampler.h"

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
  /// @param transmittance  share of the light that clouds let pass.
  /// @throws Error listing all values that are out of bounds in `spec` and `air`.
  Sun(const SunSpec& spec, const ClearAir& air, double transmittance = 1);

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

  /// A direction to the disc, or a pack of them, and the radiance from there.
  template <typename Real>
  struct Draw {
    Vec3<Real> direction, radiance;
  };
  /// Draws as `sample`; the sun must be up.
  template <typename Real>
  Draw<Real> draw(const Vec2<Real>& uniform) const noexcept {
    using std::sqrt;
    const Real depth = uniform.x * depth_;
    const Real sine2 = depth * (2.0 - depth);
    const Vec2<Real> aside = on_circle(uniform.y) * sqrt(sine2);
    return {Vec3<Real>(direction_) * (1.0 - depth) + Vec3<Real>(across_) * aside.x +
                Vec3<Real>(up_) * aside.y,
            disc_radiance(sine2)};
  }

  double transmittance() const noexcept { return transmittance_; }
  const ClearAir& air() const noexcept { return air_; }
  double distance_au() const noexcept { return distance_au_; }

 private:
  // Returns the radiance by the squared sine of the angle from the disc's centre.
  template <typename Real>
  Vec3<Real> disc_radiance(const Real& sine2) const noexcept {
    using std::max;
    using std::sqrt;
    const Real mu = sqrt(max(1.0 - sine2 / rim_squared_, Real(0.0)));
    Vec3<Real> radiance(limb_.back());
    for (std::size_t j = limb_.size() - 1; j-- > 0;)
      radiance = radiance * mu + Vec3<Real>(limb_[j]);
    return radiance;
  }

  ClearAir air_;
  double transmittance_;
  glm::dvec3 direction_;
  double distance_au_;
  double elevation_rad_;
  double radius_rad_;
  glm::dvec3 irradiance_{0};
  glm::dvec3 across_, up_;  // axes of the disc, perpendicular to direction_
  double depth_;            // 1 - cos of the disc's radius
  double rim_squared_;      // sin^2 of the disc's radius
  // Coefficients of the radiance in powers of the cosine of the angle of emission.
  std::array<glm::dvec3, 6> limb_{};
};

/// Returns the spectral irradiance, W/(m^2 nm), of a plane perpendicular to the sun's rays, for a
/// SolarBackground with the sun's direction; 0 if the sun is not up.
/// @throws Error unless the wavelength is in [300, 4000] nm.
double solar_irradiance_w_m2_nm(const Sun& sun, double wavelength_nm);

}  // namespace groundray
