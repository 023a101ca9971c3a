#include "core/appearance/oren_nayar.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace groundray::oren_nayar {
namespace {

using std::numbers::pi;

}  // namespace

double scale(double roughness) noexcept { return 1 / (1 + (0.5 - 2 / (3 * pi)) * roughness); }

double share(double cosine, double roughness) noexcept {
  const double c = std::clamp(cosine, 0.0, 1.0);
  const double s = std::sqrt(1 - c * c);
  // tan(theta) (1 - s^3) of the paper, rewritten without the division by the cosine
  const double steep = s * c * (1 + s + s * s) / (1 + s);
  const double g = s * (std::acos(c) - s * c) + 2.0 / 3 * (steep - s);
  return scale(roughness) * (1 + roughness * g / pi);
}

double mean_share(double roughness) noexcept {
  return scale(roughness) * (1 + roughness * (2.0 / 3 - 28 / (15 * pi)));
}

}  // namespace groundray::oren_nayar
