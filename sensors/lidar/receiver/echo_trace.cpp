#include "sensors/lidar/receiver/echo_trace.h"

#include <cmath>

#include "core/math.h"

namespace groundray {
namespace {

// Neighbouring samples whose logarithms differ by more than this are not part of a smooth pulse (a
// Gaussian with bins of half a sigma reaches 2.9 where it is cut off). Linear interpolation of the
// power then causes a smaller error.
constexpr double steepest = 3.5;
constexpr double steepest_ratio = 33.115;  // exp(steepest)

// Returns the u at which b + u (c - b) + bend u (1 - u) first crosses 0; it is negative at u = 0
// and not negative at u = 1.
double first_root(double b, double c, double bend) {
  const double slope = c - b + bend;
  return -2 * b / (slope + std::sqrt(std::max(0.0, slope * slope + 4 * bend * b)));
}

}  // namespace

EchoTrace::EchoTrace(std::span<const float> power_w, double ceiling_w, const Lobe& lobe)
    : power_w_(power_w),
      ceiling_w_(ceiling_w),
      lobe_(lobe),
      clipped_(power_w[lobe.peak] >= ceiling_w) {
  clipped_ ? find_plateau() : find_top();
  add_up();
}

void EchoTrace::find_plateau() {
  peak_w_ = ceiling_w_;
  std::size_t last = lobe_.end;
  while (power_w_[last] < ceiling_w_) --last;
  const double right =
      last < lobe_.end ? crossing(last, ceiling_w_).bin : static_cast<double>(lobe_.end);
  peak_bin_ = 0.5 * (first_rise(ceiling_w_).bin + right);
}

void EchoTrace::find_top() {
  const std::size_t i = lobe_.peak;
  peak_bin_ = static_cast<double>(i);
  peak_w_ = power_w_[i];
  if (i == 0 || i + 1 >= power_w_.size()) return;
  const double left = power_w_[i - 1] / peak_w_, right = power_w_[i + 1] / peak_w_;
  if (left <= 0 || right <= 0) return;
  const double before = math::log(left), after = math::log(right);
  const double curvature = -(before + after);
  const double slope = 0.5 * (after - before);
  if (!(curvature > std::abs(slope))) return;  // a corner of a plateau
  const double rise = 0.5 * slope * slope / curvature;
  peak_bin_ += slope / curvature;
  peak_w_ = std::min(peak_w_ * math::exp(rise), ceiling_w_);
  curvature_w_ = peak_w_ * curvature;
}

EchoTrace::Crossing EchoTrace::crossing(std::size_t i, double level_w) const {
  const double before = i > 0 ? power_w_[i - 1] : 0, here = power_w_[i];
  const double next = power_w_[i + 1], after = i + 2 < power_w_.size() ? power_w_[i + 2] : 0;
  const double line = (level_w - here) / (next - here);
  const Crossing straight{static_cast<double>(i) + line, std::abs(next - here)};
  if (std::min({before, here, next, after}) <= 0) return straight;
  const double a = math::log(before / level_w), b = math::log(here / level_w);
  const double c = math::log(next / level_w), d = math::log(after / level_w);
  if (std::max({std::abs(a - b), std::abs(b - c), std::abs(c - d)}) > steepest) return straight;
  // The cubic b + u (c1 + u (c2 + u c3)) through a, b, c, d at u = -1, 0, 1, 2.
  const double c1 = c - a / 3 - b / 2 - d / 6;
  const double c2 = 0.5 * (a + c) - b;
  const double c3 = (d - a) / 6 + 0.5 * (b - c);
  // The root of a parabola, improved by one Newton step.
  const double sign = b < 0 ? 1 : -1;
  const double u = first_root(sign * b, sign * c, 0.25 * sign * (b + c - a - d));
  const double slope = c1 + u * (2 * c2 + u * 3 * c3);
  if (slope * sign <= 0) return straight;
  const double refined = u - (b + u * (c1 + u * (c2 + u * c3))) / slope;
  return {static_cast<double>(i) + std::clamp(refined, 0.0, 1.0), level_w * std::abs(slope)};
}

// Returns a crossing on the parabola through the samples around the peak.
EchoTrace::Crossing EchoTrace::beside_peak(double level_w, double side) const {
  if (curvature_w_ == 0 || level_w >= peak_w_) return {peak_bin_, 0};
  const double curvature = curvature_w_ / peak_w_;
  const double away = std::sqrt(2 * math::log(peak_w_ / level_w) / curvature);
  return {peak_bin_ + side * away, level_w * curvature * away};
}

// Next to the peak the slope is small, and the parabola is more reliable than the cubic.
EchoTrace::Crossing EchoTrace::rise_after(std::size_t i, double level_w) const {
  return i + 1 == lobe_.peak && curvature_w_ > 0 ? beside_peak(level_w, -1) : crossing(i, level_w);
}

EchoTrace::Crossing EchoTrace::first_rise(double level_w) const {
  if (power_w_[lobe_.begin] >= level_w) return {static_cast<double>(lobe_.begin), 0};
  for (std::size_t i = lobe_.begin; i < lobe_.peak; ++i) {
    if (power_w_[i + 1] >= level_w) return rise_after(i, level_w);
  }
  return beside_peak(level_w, -1);
}

EchoTrace::Crossing EchoTrace::last_rise(double level_w) const {
  if (power_w_[lobe_.peak] < level_w) return beside_peak(level_w, -1);
  for (std::size_t i = lobe_.peak; i > lobe_.begin; --i) {
    if (power_w_[i - 1] < level_w) return rise_after(i - 1, level_w);
  }
  return {static_cast<double>(lobe_.begin), 0};
}

EchoTrace::Crossing EchoTrace::fall(double level_w) const {
  if (power_w_[lobe_.peak] < level_w) return beside_peak(level_w, 1);
  for (std::size_t i = lobe_.peak; i < lobe_.end; ++i) {
    if (power_w_[i + 1] < level_w) return crossing(i, level_w);
  }
  return {static_cast<double>(lobe_.end), 0};
}

EchoTrace::Extent EchoTrace::above(double level_w) const {
  std::size_t left = lobe_.peak, right = lobe_.peak;
  while (left > lobe_.begin && power_w_[left] >= level_w) --left;
  while (right < lobe_.end && power_w_[right] >= level_w) ++right;
  Extent extent{static_cast<double>(left), static_cast<double>(right)};
  extent.rises = left < lobe_.peak && power_w_[left] < level_w;
  extent.falls = right > lobe_.peak && power_w_[right] < level_w;
  if (extent.rises) extent.begin_bin += edge(left, left + 1, level_w);
  if (extent.falls) extent.end_bin -= edge(right, right - 1, level_w);
  return extent;
}

// Resembles `crossing` with half as many logarithms: interpolates from a sample below the level
// towards its neighbour above, with the logarithm's curvature at the peak. Returns the fraction of
// a bin.
double EchoTrace::edge(std::size_t below, std::size_t above, double level_w) const {
  const double outer_w = power_w_[below], inner_w = power_w_[above];
  if (!(inner_w < steepest_ratio * outer_w)) return (level_w - outer_w) / (inner_w - outer_w);
  const double u = first_root(math::log(outer_w / level_w), math::log(inner_w / level_w),
                              0.5 * curvature_w_ / peak_w_);
  return std::min(u, 1.0);
}

double EchoTrace::width_bins() const {
  const Extent half = above(0.5 * peak_w_);
  if (half.rises == half.falls) return half.end_bin - half.begin_bin;
  return 2 * (half.rises ? peak_bin_ - half.begin_bin : half.end_bin - peak_bin_);
}

void EchoTrace::add_up() {
  const float* power_w = power_w_.data();
  const float ceiling_w = static_cast<float>(ceiling_w_);
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = lobe_.begin; i < lobe_.end; ++i) {
    sum += static_cast<double>(std::min(power_w[i], ceiling_w));
  }
  sum_w_ = sum;
}

double EchoTrace::mean_bin() const {
  if (sum_w_ <= 0) return peak_bin_;  // all power is in the segment's last bin
  const float* power_w = power_w_.data() + lobe_.begin;
  const float ceiling_w = static_cast<float>(ceiling_w_);
  const int bins = static_cast<int>(lobe_.end - lobe_.begin);
  double moment = 0;
#pragma omp simd reduction(+ : moment)
  for (int i = 0; i < bins; ++i) moment += i * static_cast<double>(std::min(power_w[i], ceiling_w));
  return static_cast<double>(lobe_.begin) + moment / sum_w_;
}

}  // namespace groundray
