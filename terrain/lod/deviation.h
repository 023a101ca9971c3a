#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/pass.h"

namespace groundray {

/// Data to keep of each node: all of NodeLevel, or only its keys, which suffice for a mesh with the
/// same tolerance everywhere.
enum class NodeDetail { KeysOnly, Full };

/// Certifies every node of the quadtree over `grid`, which is entirely in memory.
/// @param block_cells  cells along a node's side: even, from 2 to Lattice::max_block_cells.
/// @return levels 0 to Lattice::top_level(), each complete; the same bits for any runner.
/// @throws Error if block_cells is invalid.
std::vector<NodeLevel> certify(const HeightGrid& grid, int block_cells, NodeDetail detail,
                               const PassRunner& runner = {});

/// Returns nodes about which nothing is known yet; see accumulate_deviations.
NodeLevel unknown_nodes(glm::ivec2 size, NodeDetail detail);

/// Accumulates into nodes of one level everything that a window of the DEM shows of them over its
/// cells: deviations and, at level 0, holes and the lowest and highest sample. Once windows that
/// cover a node have been added, in any order, its values are those of `certify` before
/// saturate_keys. They agree bit for bit if windows end where the DEM ends or where nodes of level
/// 5 end (at multiples of 32 block_cells samples); otherwise a deviation that double cannot
/// represent exactly may be rounded differently.
/// @param samples     of the DEM: all between the first and last row and column of the window.
/// @param points      of level `level`: at least those of all nodes that share a cell with
///                    `samples`.
/// @param first_node  node of the level that `nodes` begins with.
/// @param nodes       all nodes of the level that share a cell with `samples`, and any others.
///                    Empty arrays (NodeDetail::KeysOnly) stay empty.
void accumulate_deviations(const Lattice& lattice, int level, const HeightWindow& samples,
                           const HeightWindow& points, glm::ivec2 first_node, NodeLevel& nodes,
                           const PassRunner& runner = {});

/// Completes nodes of level 1 and above from their children: saturates the keys, marks holes, and
/// determines the lowest and highest samples.
/// @param children  complete nodes of the level below: all children of the nodes, and any others;
///                  `first_child` is the node that they begin with.
void saturate_keys(NodeLevel& nodes, glm::ivec2 first_node, const NodeLevel& children,
                   glm::ivec2 first_child, const PassRunner& runner = {});

}  // namespace groundray
