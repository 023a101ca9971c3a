#include "apps/groundray/dem_sight.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "reconstruction/dem/sight_bound.h"

namespace groundray {
namespace {

// Whether a point lies on the measured ground or above it: within what the bound will be raised by.
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

}  // namespace

void bound_by_sight(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking,
                    double margin_m, DemLayers& layers) {
  const PointInput input = read_points(files, scan, taking);
  std::vector<SightLine> lines;
  for (std::size_t i = 0; i < input.points_m.size(); ++i) {
    if (is_sound(layers, input.points_m[i], margin_m))
      lines.push_back({.origin_m = input.origins_m[i], .end_m = input.points_m[i]});
  }
  const std::vector<float> bound_m = sight_bound(layers.frame, {}, lines, margin_m);
  for (std::size_t i = 0; i < bound_m.size(); ++i)
    layers.upper_bound_m[i] = std::fmin(layers.upper_bound_m[i], bound_m[i]);
}

}  // namespace groundray
