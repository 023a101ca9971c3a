#include "sensors/sky/clear_sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/image/luminance.h"

namespace groundray {
namespace {

using std::numbers::pi;
constexpr int table_width = 256, table_height = 128;

// Integrates by the midpoint rule over azimuth and elevation.
glm::dvec3 irradiance_of(const HosekWilkie& model) {
  constexpr int rings = 180, sectors = 180;
  glm::dvec3 sum(0);
  for (int ring = 0; ring < rings; ++ring) {
    const double elevation = pi / 2 * (ring + 0.5) / rings;
    const double level = std::cos(elevation), height = std::sin(elevation);
    glm::dvec3 around(0);
    for (int sector = 0; sector < sectors; ++sector) {
      const double azimuth = 2 * pi * (sector + 0.5) / sectors;
      around += model.radiance({level * std::sin(azimuth), level * std::cos(azimuth), height});
    }
    sum += around * (height * level);
  }
  return sum * (pi * pi / (rings * sectors));
}

}  // namespace

ClearSky::ClearSky(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun,
                   const glm::dvec3& sun_irradiance)
    : model_(turbidity, ground_albedo, sun),
      irradiance_(irradiance_of(model_)),
      ground_(ground_albedo * (irradiance_ + sun_irradiance * sun.z) / pi),
      sampler_(tabulated()) {}

DirectionSampler ClearSky::tabulated() const {
  const LatLongGrid grid(table_width, table_height, 0);
  // Near the horizon the fit is clipped to 0 in places. This minimum ensures that the directions
  // next to them, where the radiance is positive, are drawn.
  const double least = 1e-3 * luminance(irradiance_) / pi;
  std::vector<float> weights;
  weights.reserve(std::size_t{table_width} * table_height);
  for (int y = 0; y < table_height; ++y) {
    const double polar = pi * (y + 0.5) / table_height;
    for (int x = 0; x < table_width; ++x) {
      const double azimuth = 2 * pi * ((x + 0.5) / table_width - 0.5);
      const double level = std::sin(polar);
      const glm::dvec3 direction(level * std::sin(azimuth), level * std::cos(azimuth),
                                 std::cos(polar));
      const double weight = luminance(radiance(direction));
      weights.push_back(static_cast<float>(direction.z < 0 ? weight : std::max(weight, least)));
    }
  }
  return {grid, std::move(weights)};
}

}  // namespace groundray
