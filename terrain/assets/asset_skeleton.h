#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "terrain/assets/asset_kinds.h"

namespace groundray {

/// Joint of a plant's wood, and the piece of wood from its parent to it.
struct SkeletonNode {
  glm::dvec3 p;
  std::optional<std::size_t> parent;  ///< a smaller index; none at the foot of a stem
  double radius = 0;                  ///< set by `thicken`
  /// Number of twig ends that it carries, itself included if it is one; set by `thicken`.
  int tips = 0;
  bool bears_twigs = false;  ///< if it is alive
  bool is_alive = true;
};

/// Wood of a plant; parents precede their children.
using Skeleton = std::vector<SkeletonNode>;

/// Ellipsoid that a plant fills with twigs.
struct CrownShape {
  glm::dvec3 center;
  glm::dvec3 half;
  int points = 0;        ///< number of growth goals scattered in it
  double step = 0;       ///< length of a new piece of wood
  double sight = 0;      ///< largest distance at which goals attract wood
  double reach = 0;      ///< distance at which a goal counts as reached
  double lowest = -1e9;  ///< lower bound of the goals' height
};

/// Grows a skeleton from the existing wood towards goals in the crown, by space colonisation.
/// @see Runions, Lane, Prusinkiewicz, Modeling trees with a space colonization algorithm (2007).
void colonise(Skeleton& wood, const CrownShape& crown, AssetRandom& random);

/// Sets the radii by Leonardo's rule: the cross-sections of the pieces of wood that leave a joint
/// add up to that of the piece that enters it. The thickest foot has the given radius.
void thicken(Skeleton& wood, double foot_radius);

/// Removes joints, and renumbers the parents of the others. If a joint's parent is removed, the
/// joint must be removed too.
void prune(Skeleton& wood, const std::vector<char>& is_kept);

/// Kills twigs so that about a fraction `health` of the small branches is alive, and removes most
/// of the fine twigs of the dead ones. Does nothing, and draws no random numbers, if `health` is 1.
void wither(Skeleton& wood, double health, AssetRandom& random);

/// Breaks off the top of a dead tree at a height, and most branches at random joints.
void break_off(Skeleton& wood, double height, AssetRandom& random);

}  // namespace groundray
