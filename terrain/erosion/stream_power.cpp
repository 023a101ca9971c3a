#include "terrain/erosion/stream_power.h"

#include <cstdint>
#include <vector>

#include "core/math.h"

namespace groundray {
namespace {

// Returns y of [0, fall] with y + factor y^exponent = fall, by Newton's method, kept within an
// interval that contains the solution.
double remaining_fall(double fall, double factor, double exponent) {
  if (exponent == 1) return fall / (1 + factor);
  double low = 0, high = fall, y = fall;
  for (int i = 0; i < 100 && high - low > 1e-14 * fall; ++i) {
    const double power = factor * math::pow(y, exponent);
    const double excess = y + power - fall;
    (excess > 0 ? high : low) = y;
    const double next = y - excess / (1 + exponent * power / y);
    if (next == y) break;
    y = low < next && next < high ? next : (low + high) / 2;
  }
  return y;
}

}  // namespace

void incise(const FlowTree& tree, std::span<const double> areas_m2, const StreamPower& law,
            double years, std::span<double> heights_m) {
  std::vector<double> levels_m(heights_m.size());  // of the ground, or of the water above it
  for (const std::uint32_t at : tree.order) {
    const std::uint32_t to = tree.receivers[at];
    levels_m[at] = heights_m[at];
    if (to == at) continue;
    heights_m[at] += law.uplift_m_yr * years;
    levels_m[at] = levels_m[to];
    const double fall_m = heights_m[at] - levels_m[to];
    if (!(fall_m > 0)) continue;
    const double factor = law.erodibility * years * math::pow(areas_m2[at], law.area_exponent) /
                          math::pow(tree.distances_m[at], law.slope_exponent);
    heights_m[at] = levels_m[to] + remaining_fall(fall_m, factor, law.slope_exponent);
    levels_m[at] = heights_m[at];
  }
}

}  // namespace groundray
