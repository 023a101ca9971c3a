#include "core/tracing/ground_slope.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/math.h"

namespace groundray {
namespace {

// The samples of a level, and their places in the DEM's grid.
struct LevelSamples {
  const Level& level;
  glm::ivec2 last = level.heights.size() - 1;
  glm::ivec2 last_place = glm::min(level.first + last * level.step, level.frame.samples - 1);

  bool contains(glm::dvec2 at) const noexcept {
    return level.first.x <= at.x && at.x <= last_place.x && level.first.y <= at.y &&
           at.y <= last_place.y;
  }
  glm::ivec2 place(glm::ivec2 sample) const noexcept {
    return glm::min(level.first + sample * level.step, last_place);
  }
  double height_m(glm::ivec2 sample) const noexcept { return level.heights(sample.x, sample.y); }
  glm::ivec2 cell_at(glm::dvec2 at) const noexcept {
    return glm::clamp((glm::ivec2(glm::floor(at)) - level.first) / level.step, glm::ivec2(0),
                      last - 1);
  }
};

// Returns the change of height per cell of the DEM along an axis; NaN if too many samples are
// missing.
double gradient_m(const LevelSamples& samples, glm::ivec2 sample, glm::length_t axis) noexcept {
  const auto neighbour = [&](int step) {
    glm::ivec2 other = sample;
    other[axis] = std::clamp(other[axis] + step, 0, samples.last[axis]);
    return std::isnan(samples.height_m(other)) ? sample : other;
  };
  const glm::ivec2 before = neighbour(-1), after = neighbour(1);
  return (samples.height_m(after) - samples.height_m(before)) /
         (samples.place(after) - samples.place(before))[axis];
}

}  // namespace

std::optional<double> ground_slope_rad(const RayTracer& ground, glm::dvec2 p) noexcept {
  for (const LevelScene& scene : ground.levels()) {
    const LevelSamples samples{scene.level()};
    const glm::dvec2 at = samples.level.frame.to_grid(p);
    if (!samples.contains(at)) continue;
    const glm::ivec2 cell = samples.cell_at(at);
    const glm::dvec2 first(samples.place(cell));
    const glm::dvec2 t = (at - first) / (glm::dvec2(samples.place(cell + 1)) - first);
    glm::dvec2 gradient(0);  // metres per metre
    for (int down = 0; down < 2; ++down) {
      for (int right = 0; right < 2; ++right) {
        const glm::ivec2 sample = cell + glm::ivec2(right, down);
        const double weight = (right == 1 ? t.x : 1 - t.x) * (down == 1 ? t.y : 1 - t.y);
        for (glm::length_t axis = 0; axis < 2; ++axis)
          gradient[axis] +=
              weight * gradient_m(samples, sample, axis) * samples.level.frame.cells_per_m[axis];
      }
    }
    const double slope_rad = math::atan(glm::length(gradient));
    return std::isnan(slope_rad) ? std::nullopt : std::optional(slope_rad);
  }
  return std::nullopt;
}

}  // namespace groundray
