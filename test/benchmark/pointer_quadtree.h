#pragma once

#include <span>

#include "core/geometry/height_grid.h"
#include "terrain/lod/lattice.h"
#include "terrain/terrain_mesh.h"

namespace groundray::benchmark {

/// Builds the mesh of build_terrain_mesh with the textbook data structures, as a baseline: heap
/// nodes with pointers to children and parent; a recursive split by key that first splits coarser
/// neighbours, found through the common ancestor; and a recursive traversal that emits each leaf's
/// triangles, with vertices numbered by a hash map. Single-threaded.
/// @param levels  keys, as returned by `certify`.
/// @see Samet, Neighbor finding techniques for images represented by quadtrees (1982); de Berg et
/// al., Computational Geometry (2008), section 14.2, on balanced quadtrees.
TerrainMesh mesh_by_pointers(const HeightGrid& grid, std::span<const NodeLevel> levels,
                             int block_cells, double tolerance_m);

}  // namespace groundray::benchmark
