#pragma once

#include <span>

#include "core/height_grid.h"
#include "terrain/node_level.h"
#include "terrain/terrain_mesh.h"

namespace groundray::benchmark {

/// What to compare with: the mesh of build_terrain_mesh made as textbooks do. Nodes on the heap
/// with pointers to children and parent; a recursive split by key that first splits coarser
/// neighbours, which are found by way of the common ancestor; a recursive walk that writes each
/// leaf's triangles, vertices being numbered by a hash map. On one thread.
/// @param levels  keys, as `certify` gives them.
/// @see Samet, Neighbor finding techniques for images represented by quadtrees (1982); de Berg et
///      al., Computational Geometry (2008), section 14.2, on balanced quadtrees.
TerrainMesh mesh_by_pointers(const HeightGrid& grid, std::span<const NodeLevel> levels,
                             int block_cells, double tolerance_m);

}  // namespace groundray::benchmark
