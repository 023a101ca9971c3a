#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>

#include "core/math.h"
#include "reconstruction/mesh/scan/beam_columns.h"
#include "reconstruction/mesh/scan/firing_lattice.h"

namespace groundray {
namespace {

constexpr double even_steps = 1. / 8;     // median deviation in steps that needs no correction
constexpr double least_gain = 2;          // in evenness; otherwise there is no motion
constexpr double farthest_drive_m = 100;  // approximate distance travelled in a scan
constexpr std::size_t least_returns = 64;
constexpr int most_passes = 10;

// Parameters of the fit: rate of azimuth, and c and w of the sensor position c + w clock.
using Fit = Eigen::Matrix<double, 5, 1>;

/// Growth of azimuth from pulse to pulse of a ring.
struct Pace {
  double rate_rad = 0;  // per unit of the clock; 0 if not approximately constant
  double step_rad = 0;
};

Pace pace_of(std::span<const double> clock, std::span<const std::int32_t> row,
             std::span<const double> azimuth_rad) {
  std::vector<std::size_t> order(clock.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    return std::tuple(row[a], clock[a], a) < std::tuple(row[b], clock[b], b);
  });
  std::vector<double> rates, steps;
  for (std::size_t i = 1; i < order.size(); ++i) {
    const std::size_t a = order[i - 1], b = order[i];
    if (row[a] != row[b] || !(clock[b] > clock[a])) continue;
    const double step_rad = wrapped(azimuth_rad[b] - azimuth_rad[a]);
    steps.push_back(std::abs(step_rad));
    rates.push_back(step_rad / (clock[b] - clock[a]));
  }
  if (rates.size() < least_returns) return {};
  const double rate = upper_median(rates);
  const auto like = std::ranges::count_if(
      rates, [rate](double r) { return std::abs(r - rate) <= std::abs(rate) / 2; });
  if (static_cast<double>(like) < 0.75 * static_cast<double>(rates.size())) return {};
  return {rate, upper_median(steps)};
}

/// Fit of the growth of azimuths, with an offset for each ring.
class MotionFit {
 public:
  MotionFit(std::span<const double> clock, const BeamRows& rows, const PlanPlaces& places,
            const Pace& pace)
      : row_(rows.row), ring_rad_(static_cast<std::size_t>(rows.count)) {
    const auto [first, last] = std::ranges::minmax(clock);
    const double span = last - first;
    fit_[0] = pace.rate_rad * span;
    for (std::size_t i = 0; i < clock.size(); ++i) {
      const double a = places.azimuths_rad[i], m = places.distances_m[i];
      share_.push_back((clock[i] - first) / span - 0.5);
      x_m_.push_back(m * math::cos(a));
      y_m_.push_back(m * math::sin(a));
    }
    azimuth_rad_.assign(places.azimuths_rad.begin(), places.azimuths_rad.end());
    off_rad_.resize(clock.size());
    begin_rings();
    measure();
  }

  /// Improves the first `unknowns` parameters of the fit until they converge.
  void solve(Eigen::Index unknowns) {
    for (int pass = 0; pass < most_passes; ++pass) {
      const double before = middle_off_rad();
      improve(unknowns);
      measure();
      if (middle_off_rad() > 0.99 * before) return;
    }
  }

  double middle_off_rad() const {
    std::vector<double> off(off_rad_.size());
    std::ranges::transform(off_rad_, off.begin(), [](double o) { return std::abs(o); });
    return upper_median(off);
  }
  std::vector<double> azimuths_rad() && { return std::move(azimuth_rad_); }

 private:
  std::size_t ring(std::size_t i) const { return static_cast<std::size_t>(row_[i]); }

  void begin_rings() {
    std::vector<Phasor> sum(ring_rad_.size());
    for (std::size_t i = 0; i < share_.size(); ++i)
      sum[ring(i)] += phasor_of(azimuth_rad_[i] - fit_[0] * share_[i]);
    for (std::size_t r = 0; r < sum.size(); ++r) ring_rad_[r] = phase_rad(sum[r]);
  }

  void measure() {
    const bool is_still = fit_.tail<4>().isZero(0);
    for (std::size_t i = 0; i < share_.size(); ++i) {
      const double x_m = x_m_[i] - fit_[1] - fit_[3] * share_[i];
      const double y_m = y_m_[i] - fit_[2] - fit_[4] * share_[i];
      if (!is_still) azimuth_rad_[i] = math::atan2(y_m, x_m);
      off_rad_[i] = wrapped(azimuth_rad_[i] - fit_[0] * share_[i] - ring_rad_[ring(i)]);
    }
  }

  // Returns the decrease of a return's azimuth residual per unit of each unknown.
  Fit slope(std::size_t i) const {
    const double x_m = x_m_[i] - fit_[1] - fit_[3] * share_[i];
    const double y_m = y_m_[i] - fit_[2] - fit_[4] * share_[i];
    const double square_m2 = std::max(x_m * x_m + y_m * y_m, 1e-6);
    const double along_x = -y_m / square_m2, along_y = x_m / square_m2;
    Fit slope;
    slope << share_[i], along_x, along_y, along_x * share_[i], along_y * share_[i];
    return slope;
  }

  void improve(Eigen::Index unknowns);

  std::span<const std::int32_t> row_;
  std::vector<double> share_, x_m_, y_m_;  // fraction of the clock's span, -1/2 to 1/2
  std::vector<double> azimuth_rad_, off_rad_, ring_rad_;
  Fit fit_ = Fit::Zero();
};

/// Performs a Gauss-Newton step with weights that fall with the residual: returns near edges depend
/// on the scene rather than on the sensor. The rings' offsets are eliminated.
void MotionFit::improve(Eigen::Index unknowns) {
  const double scale_rad = std::max(middle_off_rad(), 1e-9);
  const auto weight = [&](std::size_t i) {
    const double off = off_rad_[i] / (3 * scale_rad);
    return 1 / (1 + off * off);
  };
  std::vector<Fit> mean(ring_rad_.size(), Fit::Zero());
  std::vector<double> mean_off(ring_rad_.size()), weights(ring_rad_.size());
  for (std::size_t i = 0; i < share_.size(); ++i) {
    const double w = weight(i);
    mean[ring(i)] += w * slope(i);
    mean_off[ring(i)] += w * off_rad_[i];
    weights[ring(i)] += w;
  }
  for (std::size_t r = 0; r < weights.size(); ++r) {
    if (weights[r] <= 0) continue;
    mean[r] /= weights[r];
    mean_off[r] /= weights[r];
  }
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Fit right = Fit::Zero();
  for (std::size_t i = 0; i < share_.size(); ++i) {
    const Fit row = slope(i) - mean[ring(i)];
    normal += weight(i) * row * row.transpose();
    right += weight(i) * (off_rad_[i] - mean_off[ring(i)]) * row;
  }
  // Parameters that the returns do not determine keep their values.
  normal.diagonal().array() += scale_rad * scale_rad / (farthest_drive_m * farthest_drive_m);
  const Fit step = [&] {
    Fit found = Fit::Zero();
    found.head(unknowns) =
        normal.topLeftCorner(unknowns, unknowns).ldlt().solve(right.head(unknowns));
    return found;
  }();
  if (!step.allFinite()) return;
  fit_ += step;
  for (std::size_t r = 0; r < ring_rad_.size(); ++r)
    ring_rad_[r] += mean_off[r] - mean[r].dot(step);
}

}  // namespace

std::optional<std::vector<double>> azimuths_as_fired(std::span<const double> clock,
                                                     const BeamRows& rows,
                                                     const PlanPlaces& places) {
  if (clock.size() < least_returns) return std::nullopt;
  const Pace pace = pace_of(clock, rows.row, places.azimuths_rad);
  if (pace.rate_rad == 0) return std::nullopt;
  MotionFit fit(clock, rows, places, pace);
  fit.solve(1);
  const double still_rad = fit.middle_off_rad();
  if (still_rad <= even_steps * pace.step_rad) return std::nullopt;
  fit.solve(5);
  if (least_gain * fit.middle_off_rad() > still_rad) return std::nullopt;
  return std::move(fit).azimuths_rad();
}

}  // namespace groundray
