#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <numbers>

#include "core/random.h"
#include "terrain/assets/asset.h"

namespace groundray {

/// Random numbers of one asset, in the order in which it is generated.
class AssetRandom {
 public:
  AssetRandom(AssetKind kind, Seed seed)
      : key_{.seed = seed,
             .sensor = static_cast<std::uint32_t>(kind),
             .stream = RandomStream::Asset} {}

  /// Returns a random number, uniform between two bounds.
  double between(double low, double high) {
    ++key_.pulse;
    return low + (high - low) * random_uniform(key_).x;
  }

  /// Returns a normal random number of mean 0 and standard deviation 1.
  double normal() {
    ++key_.pulse;
    return random_normal(key_).x;
  }

  double angle_rad() { return between(0, 2 * std::numbers::pi); }

  /// Returns a unit vector, uniform over all directions.
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
