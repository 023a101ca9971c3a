#include "reconstruction/dem/data_distance.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include "core/error.h"

namespace groundray {
namespace {

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
