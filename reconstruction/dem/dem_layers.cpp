#include "reconstruction/dem/dem_layers.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/error.h"
#include "core/io/memory.h"

namespace groundray {
namespace {

constexpr double most_samples_per_side = 1 << 30;

void refuse_area(Violations& broken, const Area& area) {
  const bool is_bounded = std::isfinite(area.low_m.x) && std::isfinite(area.low_m.y) &&
                          std::isfinite(area.high_m.x) && std::isfinite(area.high_m.y);
  broken.unless(is_bounded && !area.is_empty(),
                "the area ({}, {}) to ({}, {}) m must be bounded and not empty", area.low_m.x,
                area.low_m.y, area.high_m.x, area.high_m.y);
}

// Range of samples: the first, counted from the sample at `zero_m`, and their number, at least two.
struct SampleRange {
  double first = 0;
  double count = 0;
};

// Returns the samples, counted from the one at zero_m, whose cells overlap the interval's interior.
SampleRange samples_over(double low_m, double high_m, double zero_m, double step_m) {
  const double a = (low_m - zero_m) / step_m + 0.5, b = (high_m - zero_m) / step_m + 0.5;
  const double low = std::min(a, b), high = std::max(a, b);
  // Cell boundaries that equal an area's except for rounding add no cells.
  const double slack = 1e-9 * std::max({1.0, std::abs(low), std::abs(high)});
  const double first = std::floor(low + slack);
  return {first, std::max(2.0, std::ceil(high - slack) - first)};
}

GridFrame frame_of(const Area& area, glm::dvec2 zero_m, glm::dvec2 step_m) {
  const SampleRange x = samples_over(area.low_m.x, area.high_m.x, zero_m.x, step_m.x);
  const SampleRange y = samples_over(area.low_m.y, area.high_m.y, zero_m.y, step_m.y);
  if (std::max(x.count, y.count) > most_samples_per_side) {
    throw Error(
        "cells of {} x {} m over {:.6g} x {:.6g} m are {:.3g} x {:.3g}: more than 2^30 along a "
        "side; choose larger cells or a smaller area",
        std::abs(step_m.x), std::abs(step_m.y), area.high_m.x - area.low_m.x,
        area.high_m.y - area.low_m.y, x.count, y.count);
  }
  return {.samples = {static_cast<int>(x.count), static_cast<int>(y.count)},
          .origin_m = zero_m + glm::dvec2(x.first, y.first) * step_m,
          .step_m = step_m,
          .cells_per_m = 1.0 / step_m};
}

constexpr double far_m2 = std::numeric_limits<double>::infinity();

// Squared distances along one line of samples: the lower envelope of parabolas over the samples.
class Line {
 public:
  explicit Line(std::size_t samples) : places_(samples), begins_(samples), values_(samples) {}

  // Transforms values in place. @param step_m  spacing of the values. @param stride  spacing of the
  // values in memory.
  void transform(double* values_m2, std::size_t stride, double step_m) {
    const std::size_t samples = values_.size();
    for (std::size_t i = 0; i < samples; ++i) values_[i] = values_m2[i * stride];
    std::size_t parabolas = 0;
    for (std::size_t i = 0; i < samples; ++i) {
      if (values_[i] == far_m2) continue;
      double begin = -far_m2;
      while (parabolas > 0) {
        begin = meeting(places_[parabolas - 1], i, step_m);
        if (begin > begins_[parabolas - 1]) break;
        --parabolas;
        begin = -far_m2;
      }
      places_[parabolas] = i;
      begins_[parabolas++] = begin;
    }
    if (parabolas == 0) return;
    for (std::size_t i = 0, k = 0; i < samples; ++i) {
      while (k + 1 < parabolas && begins_[k + 1] < static_cast<double>(i)) ++k;
      const double apart_m = (static_cast<double>(i) - static_cast<double>(places_[k])) * step_m;
      values_m2[i * stride] = apart_m * apart_m + values_[places_[k]];
    }
  }

 private:
  // Returns the position, in samples, beyond which the parabola over `b` is below that over `a`.
  double meeting(std::size_t a, std::size_t b, double step_m) const {
    const auto x = static_cast<double>(a), y = static_cast<double>(b);
    return (x + y) / 2 + (values_[b] - values_[a]) / (2 * step_m * step_m * (y - x));
  }

  std::vector<std::size_t> places_;  // samples whose parabolas are the lowest somewhere
  std::vector<double> begins_;       // positions from which these are the lowest
  std::vector<double> values_;
};

}  // namespace

GridFrame frame_over(const Area& area, double cell_m) {
  Violations broken("frame of a DEM");
  refuse_area(broken, area);
  broken.unless(std::isfinite(cell_m) && cell_m > 0, "cell_m = {} must be above 0", cell_m);
  broken.throw_if_any();
  return frame_of(area, glm::dvec2(0.5, -0.5) * cell_m, {cell_m, -cell_m});
}

GridFrame frame_like(const GridFrame& like, const Area& area, int finer) {
  refuse_faults(like);
  Violations broken("frame of a DEM");
  refuse_area(broken, area);
  broken.unless(finer >= 1, "finer = {} must be at least 1", finer);
  broken.throw_if_any();
  return frame_of(area, like.origin_m, like.step_m / static_cast<double>(finer));
}

void refuse_faults(const GridFrame& frame) {
  Violations broken("frame of a DEM");
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2,
                "{} x {} samples must be at least 2 x 2", frame.samples.x, frame.samples.y);
  broken.unless(std::isfinite(frame.origin_m.x) && std::isfinite(frame.origin_m.y),
                "origin_m = ({}, {}) must be finite", frame.origin_m.x, frame.origin_m.y);
  for (int axis = 0; axis < 2; ++axis) {
    const double step_m = frame.step_m[axis], per_m = frame.cells_per_m[axis];
    broken.unless(std::isfinite(step_m) && step_m != 0,
                  "step_m = {} along axis {} must be finite and not 0", step_m, axis);
    broken.unless(std::abs(step_m * per_m - 1) < 1e-9,
                  "cells_per_m = {} along axis {} must be 1 / step_m, where step_m = {}", per_m,
                  axis, step_m);
  }
  broken.throw_if_any();
}

DemLayers unknown_layers(const GridFrame& frame) {
  const std::size_t count =
      static_cast<std::size_t>(frame.samples.x) * static_cast<std::size_t>(frame.samples.y);
  constexpr std::size_t bytes_per_sample =
      9 * sizeof(float) + 2 * sizeof(std::uint32_t) + sizeof(std::uint16_t) + sizeof(HeightSource);
  const double bytes = static_cast<double>(count) * bytes_per_sample;
  if (const double available = available_memory_bytes(); bytes > available) {
    throw Error(
        "a DEM of {} x {} samples takes {:.1f} GiB of memory, but {:.1f} GiB are available; choose "
        "larger cells or a smaller area",
        frame.samples.x, frame.samples.y, bytes / 0x1p30, available / 0x1p30);
  }
  const std::vector<float> none(count, std::numeric_limits<float>::quiet_NaN());
  return {.frame = frame,
          .elevation_m = none,
          .variance_m2 = none,
          .lidar = std::vector<std::uint32_t>(count),
          .stereo = std::vector<std::uint32_t>(count),
          .chi2 = none,
          .surfaces = std::vector<std::uint16_t>(count),
          .overhang_m = none,
          .clearance_m = none,
          .source = std::vector<HeightSource>(count),
          .to_data_m = none,
          .fill_sd_m = none,
          .upper_bound_m = none,
          .slope_rad = none};
}

std::vector<float> data_distance_m(glm::ivec2 size, glm::dvec2 step_m,
                                   std::span<const std::uint8_t> has_data) {
  Violations broken("distance to data");
  broken.unless(size.x > 0 && size.y > 0, "a raster of {} x {} has no samples", size.x, size.y);
  broken.unless(std::isfinite(step_m.x * step_m.y) && step_m.x * step_m.y != 0,
                "step_m = [{}, {}] must be finite and not zero", step_m.x, step_m.y);
  const auto columns = static_cast<std::size_t>(size.x), rows = static_cast<std::size_t>(size.y);
  broken.unless(has_data.size() == columns * rows, "has_data has {} entries for {} samples",
                has_data.size(), columns * rows);
  broken.throw_if_any();
  std::vector<double> squares_m2(has_data.size());
  for (std::size_t i = 0; i < has_data.size(); ++i) squares_m2[i] = has_data[i] != 0 ? 0 : far_m2;
  Line down(rows);
  for (std::size_t i = 0; i < columns; ++i)
    down.transform(squares_m2.data() + i, columns, std::abs(step_m.y));
  Line across(columns);
  for (std::size_t i = 0; i < rows; ++i)
    across.transform(squares_m2.data() + i * columns, 1, std::abs(step_m.x));
  std::vector<float> distances_m(has_data.size());
  for (std::size_t i = 0; i < distances_m.size(); ++i)
    distances_m[i] = static_cast<float>(std::sqrt(squares_m2[i]));
  return distances_m;
}

}  // namespace groundray
