#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

#include "core/height_grid.h"
#include "terrain/lattice.h"
#include "terrain/node_level.h"
#include "terrain/pass.h"

namespace groundray {

/// What to keep of each node: all of NodeLevel, or its keys alone, which are all that a mesh of one
/// tolerance everywhere needs.
enum class NodeDetail { KeysOnly, Full };

/// Certifies every node of the quadtree over `grid`, which is wholly in memory.
/// @param block_cells  cells along a node's side: even, from 2 to Lattice::max_block_cells.
/// @return levels 0 to Lattice::top_level(), each whole; the same bits for any runner.
/// @throws Error if block_cells is none of these.
std::vector<NodeLevel> certify(const HeightGrid& grid, int block_cells, NodeDetail detail,
                               const PassRunner& runner = run_in_parallel);

/// A rectangle of heights in metres: samples of the DEM, or points of a level of its lattice. Holes
/// are NaN.
struct HeightWindow {
  glm::ivec2 first{0};               ///< column and row of the first height
  glm::ivec2 size{0};                ///< columns and rows
  const float* heights_m = nullptr;  ///< row by row
  std::ptrdiff_t row_stride = 0;     ///< heights from one row to the next
};

/// Returns nodes of which nothing is known yet; see accumulate_deviations.
NodeLevel unknown_nodes(glm::ivec2 size, NodeDetail detail);

/// Adds to what is known of nodes of one level all that a window of the DEM shows of them over its
/// cells: deviations and, at level 0, holes and the lowest and highest sample. Once windows that
/// cover a node have been added, in any order, its values are those of `certify` but for what
/// saturate_keys brings. Bit for bit, if windows end where nodes of level 5 do (at multiples of 32
/// block_cells samples) or the DEM; otherwise a deviation that no double holds exactly may be
/// rounded differently.
/// @param samples     of the DEM, all that lie between its first and last row and column.
/// @param points      of level `level`, at least those of all nodes that share a cell with
///                    `samples`.
/// @param first_node  node of the level that `nodes` begins with.
/// @param nodes       all nodes of the level that share a cell with `samples`, and any others.
///                    Empty arrays (NodeDetail::KeysOnly) stay empty.
void accumulate_deviations(const Lattice& lattice, int level, const HeightWindow& samples,
                           const HeightWindow& points, glm::ivec2 first_node, NodeLevel& nodes,
                           const PassRunner& runner = run_in_parallel);

/// Completes nodes of level 1 and above by what is known of their children: saturates the keys,
/// marks holes, and finds the lowest and highest samples.
/// @param children  on the level below, complete themselves: all children of the nodes, and any
///                  others; `first_child` is the node that they begin with.
void saturate_keys(NodeLevel& nodes, glm::ivec2 first_node, const NodeLevel& children,
                   glm::ivec2 first_child, const PassRunner& runner = run_in_parallel);

}  // namespace groundray
