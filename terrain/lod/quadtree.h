#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/pass.h"

namespace groundray {

/// Returns the window of all nodes of a level; it points into `level`.
NodeWindow whole_window(const NodeLevel& level);

/// Bound of a mesh's vertical deviation from the reference surface: max(tolerance_m, angle_rad d).
/// Here d is the distance from a node's bounding box to the bounding box of the sensors' positions.
/// Both boxes are in metres along the grid: (column |step_m.x|, row |step_m.y|, height).
struct MeshBound {
  double tolerance_m = 0;
  double angle_rad = 0;
  glm::dvec3 low_m{0}, high_m{0};  ///< bounding box of the sensors' positions
  glm::dvec2 cell_m{1};            ///< |step_m|
  /// Widens the sensors' box, for each level, to multiples of so many of its nodes, so that smaller
  /// movements of the sensors change nothing; 0: not widened.
  int widened_to_nodes = 0;
};

/// Restricted quadtree: the state (NodeState) of each node of each level's window, row by row.
struct Selection {
  /// Window of one level.
  struct Level {
    glm::ivec2 first{0};
    glm::ivec2 size{0};
    std::vector<std::uint8_t> state;
    /// Returns the state of a node that is in the window.
    std::uint8_t at(glm::ivec2 node) const noexcept {
      const glm::ivec2 local = node - first;
      return state[static_cast<std::size_t>(local.y) * static_cast<std::size_t>(size.x) +
                   static_cast<std::size_t>(local.x)];
    }
  };
  Lattice lattice;
  std::vector<Level> levels;
};

/// Selects the leaves: the coarsest restricted quadtree whose leaves satisfy the bound where their
/// windows permit, in which neighbours (across sides) differ by at most one level, and no leaf lies
/// partly inside a window of a finer level. The selection is monotone: a smaller bound splits every
/// node that a larger one splits.
/// @param windows  levels 0 to lattice.top_level(). The top one is the whole level. Each lies
///                 inside the next coarser one, surrounded by at least one node of that level
///                 (except at the lattice's boundary). Those of the finest levels may be empty.
/// @throws Error if the bound is negative or not a number, or if its angle or box is not finite.
Selection select_nodes(const Lattice& lattice, std::span<const NodeWindow> windows,
                       const MeshBound& bound, const PassRunner& runner = {});

/// Lists the leaves in the window of a level, except those in the window of the next finer level:
/// finer leaves first, each level row by row. Leaves without any height are omitted; deviations and
/// highest samples that `windows` do not contain are 0.
/// @param windows  as passed to select_nodes.
std::vector<Leaf> list_leaves(const Selection& selection, std::span<const NodeWindow> windows,
                              int window_level, const PassRunner& runner = {});

}  // namespace groundray
