#include "sensors/normal_spread.h"

#include <numbers>

namespace groundray {
namespace {

constexpr double unmet_sigmas = 8;     // an end this far away has no effect: 1e-15
constexpr double widest_spread = 1e4;  // in interval lengths: beyond it only the two ends matter

double density(double z) {
  return std::exp(-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
}

double share_below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace

double clamped_normal_deviation(double deviation, double lowest, double highest) noexcept {
  if (!(highest > lowest)) return 0;
  if (-lowest >= unmet_sigmas * deviation && highest >= unmet_sigmas * deviation) return deviation;
  const double sigma = std::min(deviation, widest_spread * (highest - lowest));
  const double low = lowest / sigma, high = highest / sigma;
  const double below = share_below(low), above = share_below(-high);
  const double mean = low * below + high * above + density(low) - density(high);
  const double square = low * low * below + high * high * above + (1 - below - above) +
                        low * density(low) - high * density(high);
  return sigma * std::sqrt(std::max(square - mean * mean, 0.0));
}

}  // namespace groundray
