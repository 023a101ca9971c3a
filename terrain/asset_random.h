#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <numbers>

#include "core/random.h"
#include "terrain/asset.h"

namespace groundray {

/// The random numbers of one asset, in the order of its making.
class AssetRandom {
 public:
  AssetRandom(AssetKind kind, Seed seed)
      : key_{.seed = seed,
             .sensor = static_cast<std::uint32_t>(kind),
             .stream = RandomStream::Asset} {}

  /// Uniform between two bounds.
  double between(double low, double high) {
    ++key_.pulse;
    return low + (high - low) * random_uniform(key_).x;
  }

  /// Of mean 0 and standard deviation 1.
  double normal() {
    ++key_.pulse;
    return random_normal(key_).x;
  }

  double angle_rad() { return between(0, 2 * std::numbers::pi); }

  /// A unit vector, uniform over all directions.
  glm::dvec3 direction() {
    const double z = between(-1, 1);
    const double angle = angle_rad();
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  RandomKey key_;
};

}  // namespace groundray
