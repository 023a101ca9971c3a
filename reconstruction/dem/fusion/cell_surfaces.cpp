#include "reconstruction/dem/fusion/cell_surfaces.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace groundray {
namespace {

constexpr double improbable = 0.01;

// Returns the smallest k such that a binomial variable of `points` trials is k or more with a
// probability of at most `improbable`.
std::uint32_t binomial_limit(std::uint32_t points, double share) {
  double term = math::pow(1 - share, points);  // probability of exactly k
  double tail = 1 - term;                      // probability of more than k
  std::uint32_t k = 0;
  while (tail > improbable && k < points) {
    term *= share / (1 - share) * (points - k) / (k + 1);
    ++k;
    tail -= term;
  }
  return k + 1;
}

}  // namespace

OutlierRule::OutlierRule(double share) : share_(share), small_(257) {
  for (std::uint32_t n = 2; n < small_.size(); ++n)
    small_[n] = std::max(2U, binomial_limit(n, share));
  if (share == 0) small_.assign(small_.size(), 1);
  small_[0] = small_[1] = 1;
}

std::uint32_t OutlierRule::credible(std::uint32_t points) const noexcept {
  if (points < small_.size()) return small_[points];
  if (share_ == 0) return 1;
  const double mean = points * share_;  // 99 % quantile of the normal distribution
  return static_cast<std::uint32_t>(mean + 2.33 * std::sqrt(mean * (1 - share_))) + 2;
}

float total_sd_m(const PackedPoint& point) noexcept {
  const float sd = unpacked_sd(point.sd), bias = unpacked_sd(point.bias);
  return std::sqrt(sd * sd + bias * bias);
}

void find_surfaces(std::span<const PackedPoint> ascending, double gap_m,
                   std::vector<CellSurface>& surfaces) {
  surfaces.clear();
  const auto gap = static_cast<std::int64_t>(gap_m / PackedPoint::height_step_m);
  const auto count = static_cast<std::uint32_t>(ascending.size());
  std::uint32_t begin = 0;
  const bool is_low =
      count > 0 && std::int64_t{ascending.back().height} - ascending[0].height <= gap;
  for (std::uint32_t i = is_low ? count : 1; i < count; ++i) {
    const std::int64_t step = std::int64_t{ascending[i].height} - ascending[i - 1].height;
    if (step <= gap) continue;
    const double a = total_sd_m(ascending[i - 1]), b = total_sd_m(ascending[i]);
    if (static_cast<double>(step) * PackedPoint::height_step_m <= gap_m + 3 * math::hypot(a, b))
      continue;
    surfaces.push_back({begin, i});
    begin = i;
  }
  if (count > 0) surfaces.push_back({begin, count});
}

CellSurface lower_part(std::span<const PackedPoint> ascending, const CellSurface& surface,
                       std::uint32_t credible, double tallest_m) noexcept {
  const std::uint32_t from = surface.begin + std::min(credible, surface.size()) - 1;
  const PackedPoint& foot = ascending[from];
  if (ascending[surface.end - 1].height_m() - foot.height_m() <= tallest_m) return surface;
  const double highest_m = foot.height_m() + tallest_m + 6 * total_sd_m(foot);
  const auto end = std::upper_bound(
      ascending.begin() + from, ascending.begin() + surface.end, highest_m,
      [](double limit_m, const PackedPoint& point) { return limit_m < point.height_m(); });
  return {surface.begin, static_cast<std::uint32_t>(end - ascending.begin())};
}

}  // namespace groundray
