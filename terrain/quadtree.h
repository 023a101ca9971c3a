#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/leaf.h"
#include "terrain/lattice.h"
#include "terrain/node_level.h"
#include "terrain/pass.h"

namespace groundray {

/// The rectangle of a level's nodes that may be used, and what is certified of them (see
/// NodeLevel), row by row.
struct NodeWindow {
  glm::ivec2 first{0};  ///< even, as is the end unless it is the lattice's
  glm::ivec2 size{0};
  const float* key_m = nullptr;
  const float* low_m = nullptr;  ///< low_m and high_m: needed where the bound has an angle
  const float* high_m = nullptr;
  const float* deviation_m = nullptr;  ///< deviation_m and full_m: for list_leaves
  const float* full_m = nullptr;
};

/// Returns the window of all nodes of a level; it points into `level`.
NodeWindow whole_window(const NodeLevel& level);

/// How far a mesh may lie from the reference surface, vertically: max(tolerance_m, angle_rad d), d
/// the distance from a node's box to the box of the sensors' positions. Both boxes are in metres
/// along the grid: (column |step_m.x|, row |step_m.y|, height).
struct MeshBound {
  double tolerance_m = 0;
  double angle_rad = 0;
  glm::dvec3 low_m{0}, high_m{0};  ///< the box of the sensors' positions
  glm::dvec2 cell_m{1};            ///< |step_m|
  /// If not 0, the nodes of each level are measured from the box widened to multiples of so many
  /// nodes of that level: sensors that move by less change nothing.
  int widened_to_nodes = 0;
};

/// A restricted quadtree: the state of each node of each level's window, row by row.
struct Selection {
  /// What is said of a node, as bits. The lowest four are the sides of a leaf that are thinned for
  /// a coarser neighbour (Leaf::Side).
  enum State : std::uint8_t {
    AllSides = 15,
    Split = 16,   ///< its children stand in its place
    Tight = 32,   ///< exceeds its bound but cannot be split; not thinned where that can be helped
    IsLeaf = 64,  ///< is part of the mesh
    Holed = 128,  ///< some or all samples of the DEM in it are missing
  };
  /// The window of one level.
  struct Level {
    glm::ivec2 first{0};
    glm::ivec2 size{0};
    std::vector<std::uint8_t> state;
    /// Of a node that is in the window.
    std::uint8_t at(glm::ivec2 node) const noexcept {
      const glm::ivec2 local = node - first;
      return state[static_cast<std::size_t>(local.y) * static_cast<std::size_t>(size.x) +
                   static_cast<std::size_t>(local.x)];
    }
  };
  Lattice lattice;
  std::vector<Level> levels;
};

/// Selects the leaves: the coarsest restricted quadtree whose leaves keep the bound where their
/// windows let them, neighbours (across sides) differ by one level at most, and no leaf lies partly
/// inside a window of a finer level. Monotone: a smaller bound splits every node that a larger one
/// does.
/// @param windows  levels 0 to lattice.top_level(). The top one is whole. Each lies inside the one
///                 above with at least one node of the level above it around it (none is needed at
///                 the lattice's borders); those of the finest levels may be empty.
/// @throws Error if the bound is negative or not a number.
Selection select_nodes(const Lattice& lattice, std::span<const NodeWindow> windows,
                       const MeshBound& bound, const PassRunner& runner = run_in_parallel);

/// Lists the leaves of levels first_level to last_level, finer ones first, each level's row by row.
/// Leaves without any height are left out; deviations and highest samples that `windows` do not
/// have are 0.
/// @param windows  as given to select_nodes.
std::vector<Leaf> list_leaves(const Selection& selection, std::span<const NodeWindow> windows,
                              int first_level, int last_level,
                              const PassRunner& runner = run_in_parallel);

}  // namespace groundray
