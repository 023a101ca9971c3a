#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/random.h"

namespace groundray {

/// Layer of clouds with a flat base.
struct CloudSpec {
  double cover = 0.5;         ///< share of the layer that has clouds, 0 to 1; 1 is overcast
  double optical_depth = 30;  ///< where a cloud is thickest, vertically; overcast everywhere
  double height_m = 1500;     ///< of the base above the ground
  double thickness_m = 700;   ///< where a cloud is thickest
  double size_m = 2000;       ///< of the largest clouds
  Seed variant{};             ///< selects their places
};

/// Clouds over a scene. Immutable and therefore thread-safe.
/// @see docs/theory/sky.md: Clouds.
class Clouds {
 public:
  /// @throws Error listing every value that is out of bounds.
  explicit Clouds(const CloudSpec& spec);

  /// Returns the optical depth of the layer, vertically, at a place of it.
  /// @param width_m  of the area over which it is averaged, approximately.
  double vertical_depth(glm::dvec2 place_m, double width_m) const noexcept;

  /// Intersection of a direction with the base of the layer.
  struct Crossing {
    double vertical_depth = 0;
    double cosine = 1;  ///< of the angle from the vertical there

    double depth() const noexcept { return vertical_depth / cosine; }
  };
  /// @param direction  unit, above the horizon, axes of W.
  /// @param width_rad  of the cone over which it is averaged, approximately.
  Crossing cross(const glm::dvec3& direction, double width_rad) const noexcept;

  /// Returns the share of the sun's direct light that passes; the disc is taken as a point.
  double sun_transmittance(const glm::dvec3& sun) const noexcept;

  /// Light that falls on the layer, and from a direction through clear air.
  struct Lighting {
    glm::dvec3 sun{0, 0, 1};       ///< unit direction
    glm::dvec3 sun_irradiance{0};  ///< of a plane perpendicular to the rays, W/m^2
    glm::dvec3 sky_irradiance{0};  ///< of a horizontal plane by the clear sky, W/m^2
    glm::dvec3 clear_radiance{0};  ///< W/(m^2 sr)
  };
  /// Returns the radiance from a direction above the horizon, without the sun's disc.
  glm::dvec3 radiance(const glm::dvec3& direction, double width_rad,
                      const Lighting& lighting) const noexcept;

 private:
  struct Step;
  double noise(glm::dvec2 p, double width) const noexcept;
  template <typename Act>
  void march(const glm::dvec3& direction, double width_rad, const Act& act) const noexcept;
  double depth_to_sun(const Step& at, const glm::dvec3& sun) const noexcept;

  CloudSpec spec_;
  double threshold_ = 0;        // of the noise, above which there are clouds
  std::vector<float> lattice_;  // of all octaves, random numbers from 0 to 1
};

}  // namespace groundray
