#pragma once

#include <array>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <variant>

#include "core/image/image.h"
#include "sensors/sky/clouds.h"
#include "sensors/sky/direction_sampler.h"
#include "sensors/sky/environment_map.h"
#include "sensors/sky/sun.h"

namespace groundray {

/// Radiance of the clear sky by Hosek and Wilkie, without the sun's disc. Immutable and therefore
/// thread-safe.
/// @see Hosek and Wilkie, An analytic model for full spectral sky-dome radiance, ACM Transactions
///      on Graphics 31 (2012); its coefficients for linear sRGB.
class HosekWilkie {
 public:
  /// @param turbidity  1 (pure air) to 10 (dense haze).
  /// @param ground_albedo  linear sRGB, each 0 to 1: albedo of the surroundings, which light the
  ///        sky from below.
  /// @param sun  unit direction to the sun, axes of W; not below the horizon, because the model has
  ///        no twilight.
  /// @throws Error listing all arguments that are out of bounds.
  HosekWilkie(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun);

  /// Returns the radiance from a unit direction, W/(m^2 sr); see docs/theory/sky.md for the unit. A
  /// direction below the horizon has the zenith angle of the horizon.
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

 private:
  glm::dvec3 sun_;
  std::array<glm::dvec3, 10> coefficients_;  // A to I and the mean radiance, by channel
};

/// Clear sky above flat Lambertian ground that extends to the horizon, without the sun's disc.
/// Immutable and therefore thread-safe.
class ClearSky {
 public:
  /// @param sun  unit direction to the sun, axes of W.
  /// @param sun_irradiance  irradiance of a plane perpendicular to the sun's rays, W/m^2; the
  ///        ground reflects it too.
  /// @throws Error as HosekWilkie.
  ClearSky(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun,
           const glm::dvec3& sun_irradiance);

  /// Returns the radiance from a unit direction (axes of W), linear sRGB, W/(m^2 sr).
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept {
    return direction.z < 0 ? ground_ : model_.radiance(direction);
  }

  /// Draws a direction approximately in proportion to its luminance. @see DirectionSampler
  DirectionSample sample(const glm::dvec2& uniform) const noexcept {
    return sampler_.sample(uniform);
  }
  double pdf_per_sr(const glm::dvec3& direction) const noexcept {
    return sampler_.pdf_per_sr(direction);
  }

  /// Returns the irradiance of a horizontal plane by the sky, W/m^2, accurate to 5e-5 of it.
  const glm::dvec3& horizontal_irradiance() const noexcept { return irradiance_; }

 private:
  DirectionSampler tabulated() const;

  HosekWilkie model_;
  glm::dvec3 irradiance_;
  glm::dvec3 ground_;
  DirectionSampler sampler_;
};

/// Dome with the same radiance in every direction, also below the horizon.
struct ConstantSky {
  glm::dvec3 radiance{0};  ///< linear sRGB, W/(m^2 sr); see docs/theory/sky.md for the unit
};

/// Dome given by an equirectangular image of all directions, laid out as defined by LatLongGrid.
struct EnvironmentImage {
  std::filesystem::path image;    ///< EXR or HDR, linear sRGB
  double center_azimuth_deg = 0;  ///< azimuth of its middle, clockwise from north
  EnvironmentScale scale;
};

/// Dome of a sky by Hosek and Wilkie with the air's turbidity, clear or with clouds; it requires a
/// sun above the horizon.
struct AnalyticSky {
  glm::dvec3 ground_albedo{0.2};    ///< linear sRGB; of the ground below the horizon
  std::optional<CloudSpec> clouds;  ///< which dim the sun as well
};

/// Distant light of a scene.
struct SkySpec {
  std::variant<ConstantSky, EnvironmentImage, AnalyticSky> dome = {};
  std::optional<SunSpec> sun = {};  ///< none if the image contains it, or under clouds
  ClearAir air = {};
};

/// Returns the sun of a sky, dimmed by its clouds.
/// @throws Error as Sun and Clouds.
std::optional<Sun> sun_of(const SkySpec& spec);

/// Distant light of a scene: a dome and, separately, the sun's disc, each with its own sampler. A
/// path tracer that samples both adds both estimates. Immutable and therefore thread-safe.
class Sky {
 public:
  /// @param image  pixels of the spec's EnvironmentImage; empty for other domes.
  /// @throws Error listing all values that are out of bounds in `spec`, or as EnvironmentMap for
  ///         `image`.
  explicit Sky(const SkySpec& spec, ImageF image = {});

  /// Returns the radiance of dome and sun that a ray sees after leaving the scene, linear sRGB,
  /// W/(m^2 sr).
  /// @param direction  unit, axes of W (east, north, up).
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;
  /// Returns the radiance of the dome alone.
  glm::dvec3 dome_radiance(const glm::dvec3& direction) const noexcept;
  /// Returns true if the dome is a ConstantSky.
  bool is_constant_dome() const noexcept { return std::holds_alternative<ConstantSky>(dome_); }
  /// Returns the dome's radiance at the horizon in the azimuth of a direction.
  glm::dvec3 horizon_radiance(const glm::dvec3& direction) const noexcept;

  /// Draws a direction to the dome approximately in proportion to its luminance; uniformly for a
  /// ConstantSky.
  /// @param uniform  two independent numbers in [0, 1).
  DirectionSample sample_dome(const glm::dvec2& uniform) const noexcept;
  /// Returns the density, 1/sr, with which `sample_dome` draws a unit direction.
  double dome_pdf_per_sr(const glm::dvec3& direction) const noexcept;

  /// Returns the irradiance of a horizontal plane by the upper half of the dome, W/m^2.
  glm::dvec3 dome_irradiance() const noexcept;

  const std::optional<Sun>& sun() const noexcept { return sun_; }

 private:
  using Dome = std::variant<ConstantSky, EnvironmentMap, ClearSky>;
  static Dome build_dome(const SkySpec& spec, ImageF image);

  std::optional<Sun> sun_;
  Dome dome_;
};

}  // namespace groundray
