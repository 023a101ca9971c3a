#include "terrain/trail/line_noise.h"

#include <cmath>
#include <cstdint>

namespace groundray {

double line_noise(RandomKey key, double knots) noexcept {
  const double before = std::floor(knots), t = knots - before;
  key.pulse = static_cast<std::uint32_t>(before) + 1;
  const double from = -1 + 2 * random_uniform(key).x;
  ++key.pulse;
  const double to = -1 + 2 * random_uniform(key).x;
  return std::lerp(from, to, t * t * (3 - 2 * t));
}

}  // namespace groundray
