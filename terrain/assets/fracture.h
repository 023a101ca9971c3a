#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "terrain/assets/asset_kinds.h"

namespace groundray {

/// Parallel joints of a rock mass.
struct JointSet {
  glm::dvec3 normal{0, 0, 1};  ///< unit vector
  double spacing = 1;          ///< scale of the distribution of spacings; see `joint_spacing`
};

/// Rock mass that three sets of joints cut into blocks.
struct RockMass {
  std::array<JointSet, 3> sets;
  double scatter_rad = 0;  ///< standard deviation of a joint's direction about two axes
  int chips = 0;           ///< corners and edges that broke off
};

/// Radius of the rounded edges of a `boulder`, and root mean square of its relief, over its largest
/// extent or over the distance from its middle.
inline constexpr double boulder_edge = 0.02, boulder_relief = 0.016;

/// Half-space: normal * x <= offset.
struct RockPlane {
  glm::dvec3 normal{0, 0, 1};
  double offset = 0;
};

/// Shortest and longest spacing of neighbouring joints that bound a block, over the scale.
inline constexpr double least_spacing = 0.45, most_spacing = 2;

/// Returns the spacing below which a fraction `share` of the joints of a set with a scale of 1 has
/// its neighbour: the negative exponential distribution, truncated to [least_spacing,
/// most_spacing].
/// @see Priest and Hudson, Discontinuity spacings in rock, Int. J. Rock Mech. Min. Sci. 13 (1976).
double joint_spacing(double share);

/// Returns the planes of a block: two neighbouring joints of each set, at equal distances from the
/// origin, then the planes along which chips broke off.
std::vector<RockPlane> rock_block(const RockMass& mass, AssetRandom& random);

/// Returns the corners of the convex body behind planes, in no special order.
std::vector<glm::dvec3> corners_of(std::span<const RockPlane> planes);

/// Returns a level of a block whose edges are rounded: 0 on its surface, negative inside, at least
/// the distance to the farthest plane. A right-angled edge recedes by as much as if it had the
/// radius `edge`.
double rounded_level(std::span<const RockPlane> planes, double edge, const glm::dvec3& p);

}  // namespace groundray
