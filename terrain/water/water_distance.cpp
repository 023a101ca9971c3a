#include "terrain/water/water_distance.h"

#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <limits>

#include "terrain/lod/pass.h"

namespace groundray {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Line of samples among those of a grid.
struct Line {
  std::size_t first = 0, stride = 1, count = 0;
  double step_m = 1;
};

// Replaces squared distances along a line by their lower envelope: at each sample the least of
// (distance along the line)^2 + the squared distance there.
void spread(const Line& line, std::vector<double>& squared_m2) {
  const auto value = [&](std::size_t i) -> double& {
    return squared_m2[line.first + i * line.stride];
  };
  const auto place_m = [&](std::size_t i) { return static_cast<double>(i) * line.step_m; };
  std::vector<std::size_t> lowest;  // samples whose parabolas make up the envelope
  std::vector<double> from_m;       // where each of them begins
  for (std::size_t i = 0; i < line.count; ++i) {
    if (value(i) == infinity) continue;
    double begin_m = -infinity;
    while (!lowest.empty()) {
      const std::size_t k = lowest.back();
      begin_m = ((value(i) + place_m(i) * place_m(i)) - (value(k) + place_m(k) * place_m(k))) /
                (2 * (place_m(i) - place_m(k)));
      if (begin_m > from_m.back()) break;
      lowest.pop_back();
      from_m.pop_back();
      begin_m = -infinity;
    }
    lowest.push_back(i);
    from_m.push_back(begin_m);
  }
  if (lowest.empty()) return;
  std::vector<double> envelope(line.count);
  std::size_t k = 0;
  for (std::size_t i = 0; i < line.count; ++i) {
    while (k + 1 < lowest.size() && from_m[k + 1] < place_m(i)) ++k;
    const double along_m = place_m(i) - place_m(lowest[k]);
    envelope[i] = along_m * along_m + value(lowest[k]);
  }
  for (std::size_t i = 0; i < line.count; ++i) value(i) = envelope[i];
}

}  // namespace

std::vector<float> distance_to_water_m(const StandingWater& water, double least_depth_m) {
  const auto columns = static_cast<std::size_t>(water.frame.samples.x);
  const auto rows = static_cast<std::size_t>(water.frame.samples.y);
  const glm::dvec2 step_m = glm::abs(water.frame.step_m);
  std::vector<double> squared_m2;
  squared_m2.reserve(water.depth_m.size());
  for (const float depth_m : water.depth_m)
    squared_m2.push_back(static_cast<double>(depth_m) >= least_depth_m ? 0 : infinity);
  run_pass(run_in_parallel, columns, [&](std::size_t column) {
    spread({.first = column, .stride = columns, .count = rows, .step_m = step_m.y}, squared_m2);
  });
  run_pass(run_in_parallel, rows, [&](std::size_t row) {
    spread({.first = row * columns, .stride = 1, .count = columns, .step_m = step_m.x}, squared_m2);
  });
  std::vector<float> distances_m;
  distances_m.reserve(squared_m2.size());
  for (const double squared : squared_m2)
    distances_m.push_back(static_cast<float>(std::sqrt(squared)));
  return distances_m;
}

}  // namespace groundray
