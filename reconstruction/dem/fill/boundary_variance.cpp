#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/math.h"
#include "reconstruction/dem/fill/dem_fill.h"

namespace groundray {
namespace {

constexpr std::uint32_t no_sample = std::numeric_limits<std::uint32_t>::max();

bool is_measured(const DemLayers& layers, std::size_t i) {
  const HeightSource source = layers.source[i];
  return source != HeightSource::None && source != HeightSource::Filled &&
         std::isfinite(layers.variance_m2[i]);
}

// Nearest measured sample of each sample, propagated from neighbour to neighbour by two sweeps: it
// may be farther than the true one by a fraction of a cell.
class NearestMeasured {
 public:
  explicit NearestMeasured(const DemLayers& layers)
      : size_(layers.frame.samples),
        step_m_(layers.frame.step_m),
        of_(layers.source.size(), no_sample) {
    for (std::size_t i = 0; i < of_.size(); ++i) {
      if (is_measured(layers, i)) of_[i] = static_cast<std::uint32_t>(i);
    }
    sweep(-1);
    sweep(1);
  }

  std::uint32_t of(std::size_t i) const { return of_[i]; }

 private:
  std::size_t number(glm::ivec2 at) const {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(at.x);
  }

  double distance2_m2(glm::ivec2 at, std::uint32_t to) const {
    if (to == no_sample) return std::numeric_limits<double>::infinity();
    const auto columns = static_cast<std::uint32_t>(size_.x);
    const glm::ivec2 there(to % columns, to / columns);
    const glm::dvec2 apart(there - at);
    const glm::dvec2 apart_m = apart * step_m_;
    return apart_m.x * apart_m.x + apart_m.y * apart_m.y;
  }

  void take(glm::ivec2 at, glm::ivec2 from) {
    if (from.x < 0 || from.y < 0 || from.x >= size_.x || from.y >= size_.y) return;
    std::uint32_t& mine = of_[number(at)];
    const std::uint32_t theirs = of_[number(from)];
    if (distance2_m2(at, theirs) < distance2_m2(at, mine)) mine = theirs;
  }

  // Propagates from the row `before` (-1: above, 1: below) to each row, then along it both ways.
  void sweep(int before) {
    for (int k = 0; k < size_.y; ++k) {
      const int row = before < 0 ? k : size_.y - 1 - k;
      for (int column = 0; column < size_.x; ++column) {
        for (const int side : {-1, 0, 1}) take({column, row}, {column + side, row + before});
        take({column, row}, {column - 1, row});
      }
      for (int column = size_.x - 1; column >= 0; --column) take({column, row}, {column + 1, row});
    }
  }

  glm::ivec2 size_;
  glm::dvec2 step_m_;
  std::vector<std::uint32_t> of_;
};

double variance_about_m2(const DemLayers& layers, std::uint32_t nearest) {
  constexpr int reach = 2;
  const glm::ivec2 size = layers.frame.samples;
  const int row = static_cast<int>(nearest / static_cast<std::uint32_t>(size.x));
  const int column = static_cast<int>(nearest % static_cast<std::uint32_t>(size.x));
  double sum_m2 = 0, weight = 0;
  for (int y = std::max(0, row - reach); y <= std::min(size.y - 1, row + reach); ++y) {
    for (int x = std::max(0, column - reach); x <= std::min(size.x - 1, column + reach); ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
                            static_cast<std::size_t>(x);
      if (!is_measured(layers, i)) continue;
      const double points = std::max(1.0, static_cast<double>(layers.lidar[i] + layers.stereo[i]));
      sum_m2 += points * static_cast<double>(layers.variance_m2[i]);
      weight += points;
    }
  }
  return sum_m2 / weight;  // the nearest sample itself is measured
}

}  // namespace

void add_boundary_variance(DemLayers& layers) {
  const NearestMeasured nearest(layers);
  for (std::size_t i = 0; i < layers.fill_sd_m.size(); ++i) {
    if (std::isnan(layers.fill_sd_m[i]) || nearest.of(i) == no_sample) continue;
    const double sd_m = math::hypot(static_cast<double>(layers.fill_sd_m[i]),
                                    std::sqrt(variance_about_m2(layers, nearest.of(i))));
    layers.fill_sd_m[i] = static_cast<float>(sd_m);
  }
}

}  // namespace groundray
