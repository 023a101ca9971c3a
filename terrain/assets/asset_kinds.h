#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <numbers>
#include <optional>

#include "core/math.h"
#include "core/model/model.h"
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
    return {r * math::cos(angle), r * math::sin(angle), z};
  }

 private:
  RandomKey key_;
};

/// Valid members of an AssetSpec, completed with the defaults of its kind.
struct AssetShape {
  double size_m = 0, width_m = 0, sag_m = 0, per_m2 = 0;
  std::optional<double> square_m;
  double leaf_area_index = 0, detail = 1;
  LeafModel leaves = LeafModel::Cards;
  double health = 1;
  Seed seed{};
  AssetRandom random;
};

// Generators of the kinds.
Model make_rock(AssetShape shape);
Model make_stone(AssetShape shape);
Model make_grass_tuft(AssetShape shape);
Model make_shrub(AssetShape shape);
Model make_conifer(AssetShape shape);
Model make_broadleaf_tree(AssetShape shape);
Model make_fence_post(AssetShape shape);
Model make_wire(AssetShape shape);
Model make_vehicle(AssetShape shape);
Model make_person_cylinder(AssetShape shape);
Model make_calibration_board(AssetShape shape);
Model make_sphere_target(AssetShape shape);
Model make_spruce(AssetShape shape);
Model make_pine(AssetShape shape);
Model make_birch(AssetShape shape);
Model make_oak(AssetShape shape);
Model make_bush(AssetShape shape);
Model make_snag(AssetShape shape);
Model make_fern(AssetShape shape);
Model make_reed(AssetShape shape);
Model make_grass_patch(AssetShape shape);
Model make_fallen_log(AssetShape shape);
Model make_stump(AssetShape shape);
Model make_person(AssetShape shape);
Model make_deer(AssetShape shape);
Model make_pickup(AssetShape shape);
Model make_ugv(AssetShape shape);
Model make_tractor(AssetShape shape);
Model make_straight_fence(AssetShape shape);
Model make_sign(AssetShape shape);
Model make_hay_bale(AssetShape shape);
Model make_boulder(AssetShape shape);

/// Returns valid members, completed with the defaults of the kind.
AssetShape asset_shape(const AssetSpec& spec);

/// Returns the number of squares along a length, from 1 to 1000, or nothing if squares of this side
/// do not fill it.
std::optional<int> squares_along(double length_m, double square_m);

}  // namespace groundray
