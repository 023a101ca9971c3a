#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <variant>

#include "core/image.h"
#include "sensors/clear_sky.h"
#include "sensors/direction_sampler.h"
#include "sensors/environment_map.h"
#include "sensors/sun.h"

namespace groundray {

/// The same radiance from every direction, below the horizon too.
struct ConstantSky {
  glm::dvec3 radiance{0};  ///< linear sRGB, W/(m^2 sr); see docs/sky.md for the unit
};

/// An equirectangular image of all directions, laid out as LatLongGrid says.
struct EnvironmentImage {
  std::filesystem::path image;    ///< EXR or HDR, linear sRGB
  double center_azimuth_deg = 0;  ///< where its middle looks, clockwise from north
  EnvironmentScale scale;
};

/// A clear sky by Hosek and Wilkie, of the air's turbidity; it needs a sun above the horizon.
struct AnalyticSky {
  glm::dvec3 ground_albedo{0.2};  ///< linear sRGB; what is below the horizon
};

/// What lights a scene from afar.
struct SkySpec {
  std::variant<ConstantSky, EnvironmentImage, AnalyticSky> dome = {};
  std::optional<SunSpec> sun = {};  ///< none where an image has it, or under clouds
  ClearAir air = {};
};

/// All that shines from afar: a dome, and apart from it the sun's disc, each with a sampler of its
/// own. A path tracer that draws from both adds both estimates. Immutable, so any number of threads
/// may use one.
class Sky {
 public:
  /// @param image  the pixels of the spec's EnvironmentImage; of other domes there is none.
  /// @throws Error listing what is out of bounds in `spec`, or as EnvironmentMap of `image`.
  explicit Sky(const SkySpec& spec, ImageF image = {});

  /// Returns what a ray that leaves the scene sees: dome and sun. Linear sRGB, W/(m^2 sr).
  /// @param direction  unit, axes of W (east, north, up).
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;
  /// Returns the same without the sun.
  glm::dvec3 dome_radiance(const glm::dvec3& direction) const noexcept;
  /// Whether the dome is the same from everywhere.
  bool is_constant_dome() const noexcept { return std::holds_alternative<ConstantSky>(dome_); }
  /// Returns what the dome shines with at the horizon below or above a direction.
  glm::dvec3 horizon_radiance(const glm::dvec3& direction) const noexcept;

  /// Draws a direction to the dome about in proportion to its luminance.
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
