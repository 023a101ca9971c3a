#include "core/random.h"

#include <Random123/philox.h>

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <numbers>
#include <utility>

#include "core/math.h"

namespace groundray {
namespace {

// Maps 52 bits to (0, 1), with a half step added: never 0, never 1.
double open_unit(std::uint32_t high, std::uint32_t low) noexcept {
  const std::uint64_t bits = (std::uint64_t{high} << 32 | low) >> 12;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52;
}

}  // namespace

std::array<std::uint32_t, 4> random_bits(const RandomKey& key) noexcept {
  // A pulse has at most 2^20 sub-rays and 2^12 streams, so both share a word of the counter.
  const r123::Philox4x32::ctr_type counter = {
      {key.frame, key.pulse, key.sub_ray << 12 | static_cast<std::uint32_t>(key.stream),
       key.sensor}};
  const r123::Philox4x32::key_type words = {{static_cast<std::uint32_t>(key.seed.value),
                                             static_cast<std::uint32_t>(key.seed.value >> 32)}};
  const auto block = r123::Philox4x32{}(counter, words);
  return {block[0], block[1], block[2], block[3]};
}

glm::dvec2 random_uniform(const RandomKey& key) noexcept {
  const auto bits = random_bits(key);
  return {open_unit(bits[0], bits[1]), open_unit(bits[2], bits[3])};
}

glm::dvec2 random_normal(const RandomKey& key) noexcept {
  const glm::dvec2 u = random_uniform(key);
  const double radius = std::sqrt(-2 * math::log(u.x));
  const double angle_rad = 2 * std::numbers::pi * u.y;
  return {radius * math::cos(angle_rad), radius * math::sin(angle_rad)};
}

namespace {

// Returns log(n!), for n above 9 by Stirling's series, whose first omitted term is less than 1e-12.
double log_factorial(double n) noexcept {
  constexpr std::array<double, 10> small{1, 1, 2, 6, 24, 120, 720, 5040, 40320, 362880};
  if (n < 10) return math::log(small[static_cast<std::size_t>(n)]);
  const double m = n + 1, inverse = 1 / (m * m);
  return (m - 0.5) * math::log(m) - m + 0.5 * math::log(2 * std::numbers::pi) +
         (1.0 / 12 - inverse * (1.0 / 360 - inverse * (1.0 / 1260 - inverse / 1680))) / m;
}

// Samples by inversion of the cumulative distribution, for means below 10.
double poisson_by_inversion(const RandomKey& key, double mean) noexcept {
  double left = random_uniform(key).x, probability = math::exp(-mean), count = 0;
  while (left > probability && probability > 0) {
    left -= probability;
    probability *= mean / ++count;
  }
  return count;
}

}  // namespace

double random_poisson(RandomKey key, double mean) noexcept {
  if (!(mean > 0)) return 0;
  mean = std::min(mean, 1e9);
  if (mean < 10) return poisson_by_inversion(key, mean);
  const double b = 0.931 + 2.53 * std::sqrt(mean), a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
  const double sure = 0.9277 - 3.6224 / (b - 2);
  for (;; ++key.sub_ray) {
    const auto [u, v] = [&] {
      const glm::dvec2 both = random_uniform(key);
      return std::pair(both.x - 0.5, both.y);
    }();
    const double rest = 0.5 - std::abs(u);
    const double count = std::floor((2 * a / rest + b) * u + mean + 0.43);
    if (rest >= 0.07 && v <= sure) return count;
    if (count < 0 || (rest < 0.013 && v > rest)) continue;
    if (math::log(v * inverse_alpha / (a / (rest * rest) + b)) <=
        count * math::log(mean) - mean - log_factorial(count))
      return count;
  }
}

}  // namespace groundray
