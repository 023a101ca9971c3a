#pragma once

#include <cstdint>
#include <glm/vec2.hpp>

#include "core/random.h"

namespace groundray {

/// Clusters in which the plants of a layer grow.
struct Clusters {
  double size_m = 1;    ///< side of the lattice cells, half of which have a cluster
  double contrast = 1;  ///< from 0, even, to 1: nothing grows between clusters
};

/// Random field of mean 1 by which clusters multiply a density: a sum of bumps at random positions,
/// one for about every second cell of a square lattice. A function of position, seed and layer
/// alone. Immutable; any number of threads may query it.
/// @see docs/reference/scatter.md
class ClusterField {
 public:
  /// @param clusters  with a positive size, and a contrast from 0 to 1.
  ClusterField(const Clusters& clusters, Seed seed, std::uint32_t layer);

  /// Returns the field at a position in W, from 0 to highest().
  double at(glm::dvec2 p_W) const noexcept;
  /// Returns an upper bound of the field.
  double highest() const noexcept;

 private:
  Clusters clusters_;
  Seed seed_;
  std::uint32_t layer_;
};

}  // namespace groundray
