#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <variant>

#include "core/image/image.h"
#include "sensors/sky/clear_sky.h"
#include "sensors/sky/direction_sampler.h"
#include "sensors/sky/environment_map.h"
#include "sensors/sky/sun.h"

namespace groundray {

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

/// Dome of a clear sky by Hosek and Wilkie with the air's turbidity; it requires a sun above the
/// horizon.
struct AnalyticSky {
  glm::dvec3 ground_albedo{0.2};  ///< linear sRGB; of the ground below the horizon
};

/// Distant light of a scene.
struct SkySpec {
  std::variant<ConstantSky, EnvironmentImage, AnalyticSky> dome = {};
  std::optional<SunSpec> sun = {};  ///< none if the image contains it, or under clouds
  ClearAir air = {};
};

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
  static Dome build_dome(const SkySpec& spec, ImageF image, const std::optional<Sun>& sun);

  std::optional<Sun> sun_;
  Dome dome_;
};

}  // namespace groundray
