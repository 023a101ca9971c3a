#include "apps/groundray/dem/dem_sight.h"

#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <vector>

#include "reconstruction/dem/fill/sight_bound.h"

namespace groundray {
namespace {

// Returns true if a point is above measured ground, or below it by at most the bound's rise.
bool is_sound(const DemLayers& layers, const glm::dvec3& end_m, double margin_m) {
  constexpr double sds = 2;
  const glm::dvec2 at = glm::round(layers.frame.to_grid(glm::dvec2(end_m)));
  const glm::ivec2 samples = layers.frame.samples;
  if (!(at.x >= 0 && at.y >= 0 && at.x < samples.x && at.y < samples.y)) return false;
  const std::size_t i = static_cast<std::size_t>(at.y) * static_cast<std::size_t>(samples.x) +
                        static_cast<std::size_t>(at.x);
  const double below_m = layers.elevation_m[i] - end_m.z;  // NaN where nothing was measured
  return below_m <= margin_m + sds * std::sqrt(layers.variance_m2[i]);
}

// Part of a frame that lines of sight cross.
struct Window {
  glm::ivec2 first{0};
  GridFrame frame;
};

Window window_of(const GridFrame& frame, const std::vector<SightLine>& lines) {
  glm::dvec2 low(frame.samples), high(0);
  for (const SightLine& line : lines) {
    for (const glm::dvec3& p_m : {line.origin_m, line.end_m}) {
      const glm::dvec2 at = frame.to_grid(glm::dvec2(p_m));
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
  }
  const glm::dvec2 most(frame.samples - 1), least_last(1);  // a frame has 2 x 2 samples at least
  const glm::ivec2 last(glm::clamp(glm::ceil(high) + 1., least_last, most));
  const glm::ivec2 first(glm::clamp(glm::floor(low) - 1., glm::dvec2(0), glm::dvec2(last - 1)));
  Window window{first, frame};
  window.frame.samples = last - first + 1;
  window.frame.origin_m = frame.to_D(first);
  return window;
}

void lower(const Window& window, const std::vector<float>& bound_m, DemLayers& layers) {
  const auto columns = static_cast<std::size_t>(layers.frame.samples.x);
  std::size_t i = 0;
  for (int row = 0; row < window.frame.samples.y; ++row) {
    std::size_t to = static_cast<std::size_t>(window.first.y + row) * columns +
                     static_cast<std::size_t>(window.first.x);
    for (int column = 0; column < window.frame.samples.x; ++column, ++i, ++to)
      layers.upper_bound_m[to] = std::fmin(layers.upper_bound_m[to], bound_m[i]);
  }
}

}  // namespace

void bound_by_sight(LidarPoints& points, double margin_m, DemLayers& layers) {
  constexpr double sds = 2;
  for (LidarBlock block; points.next(block);) {
    std::vector<SightLine> lines;
    for (std::size_t i = 0; i < block.points.size(); ++i) {
      const glm::dvec3& end_m = block.points.p_m[i];
      if (!is_sound(layers, end_m, margin_m)) continue;
      const glm::dvec3 up_m(0, 0,
                            sds * std::hypot(block.points.sd_m[i], block.points.bias_sd_m[i]));
      lines.push_back({.origin_m = block.origins_m[i] + up_m, .end_m = end_m + up_m});
    }
    if (lines.empty()) continue;
    const Window window = window_of(layers.frame, lines);
    lower(window, sight_bound(window.frame, {}, lines, margin_m), layers);
  }
}

}  // namespace groundray
