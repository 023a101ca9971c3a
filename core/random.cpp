#include "core/random.h"

#include <Random123/philox.h>

#include <cmath>
#include <glm/vec2.hpp>
#include <numbers>

namespace groundray {
namespace {

// 52 bits and a half step: never 0, never 1.
double open_unit(std::uint32_t high, std::uint32_t low) noexcept {
  const std::uint64_t bits = (std::uint64_t{high} << 32 | low) >> 12;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52;
}

}  // namespace

std::array<std::uint32_t, 4> random_bits(const RandomKey& key) noexcept {
  // A sensor has at most 2^20 sub-rays of a pulse and 2^12 streams, so both share a counter word.
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
  const double radius = std::sqrt(-2 * std::log(u.x));
  const double angle_rad = 2 * std::numbers::pi * u.y;
  return {radius * std::cos(angle_rad), radius * std::sin(angle_rad)};
}

}  // namespace groundray
