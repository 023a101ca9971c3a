#include "reconstruction/mesh/accuracy/distance_sums.h"

#include <algorithm>
#include <cmath>

namespace groundray {

void DistanceSums::add(double distance_m, double spread_m, double high_m, double high_square_m2,
                       double part_m2) noexcept {
  const double low_m = std::max(0.0, distance_m - spread_m);
  ++samples;
  area_m2 += part_m2;
  distance += part_m2 * distance_m;
  square += part_m2 * distance_m * distance_m;
  spread += part_m2 * spread_m * spread_m;
  low += part_m2 * low_m;
  low_square += part_m2 * low_m * low_m;
  high += part_m2 * std::min(high_m, distance_m + spread_m);
  high_square += part_m2 * high_square_m2;
}

void DistanceSums::operator+=(const DistanceSums& more) noexcept {
  for (double DistanceSums::*sum :
       {&DistanceSums::distance, &DistanceSums::square, &DistanceSums::low,
        &DistanceSums::low_square, &DistanceSums::high, &DistanceSums::high_square,
        &DistanceSums::spread, &DistanceSums::area_m2})
    this->*sum += more.*sum;
  samples += more.samples;
}

// Over a part, the mean differs from the distance at the centroid by at most the root-mean-square
// difference (spread). By Minkowski's inequality, root mean squares differ by at most the root mean
// square of the difference.
DistanceSums::Means DistanceSums::means(double rounding_m, double sum_rounding) const noexcept {
  const double slack_m = rounding_m + sum_rounding * high / area_m2;
  const double rms_m = std::sqrt(square / area_m2), spread_m = std::sqrt(spread / area_m2);
  const double low_m = std::max(rms_m - spread_m, std::sqrt(low_square / area_m2));
  const double high_m = std::min(rms_m + spread_m, std::sqrt(high_square / area_m2));
  return {.mean = {distance / area_m2, std::max(0.0, low / area_m2 - slack_m),
                   high / area_m2 + slack_m},
          .rms = {rms_m, std::max(0.0, low_m - slack_m), high_m + slack_m}};
}

}  // namespace groundray
