#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "terrain/asset_random.h"

namespace groundray {

/// A joint of a plant's wood and the piece of wood from its parent to it.
struct SkeletonNode {
  glm::dvec3 p;
  std::optional<std::size_t> parent;  ///< a smaller number; none at the foot of a stem
  double radius = 0;                  ///< set by `thicken`
  int tips = 0;  ///< how many twigs' ends it bears, itself among them; likewise
};

/// The wood of a plant, parents before children.
using Skeleton = std::vector<SkeletonNode>;

/// An ellipsoid that a plant fills with twigs.
struct CrownShape {
  glm::dvec3 center;
  glm::dvec3 half;
  int points = 0;        ///< goals of growth that are scattered in it
  double step = 0;       ///< length of new wood
  double sight = 0;      ///< how far away goals attract
  double reach = 0;      ///< how near they are reached
  double lowest = -1e9;  ///< no goal is under this height
};

/// Grows a skeleton from the wood that there is to where goals are left.
/// @see Runions, Lane, Prusinkiewicz, Modeling trees with a space colonization algorithm (2007).
void colonise(Skeleton& wood, const CrownShape& crown, AssetRandom& random);

/// Sets the radii: all of the wood that leaves a joint has the cross-section of that which comes in
/// (Leonardo's rule), and the thickest foot has the radius given.
void thicken(Skeleton& wood, double foot_radius);

}  // namespace groundray
