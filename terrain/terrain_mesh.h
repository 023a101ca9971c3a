#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/lod/pass.h"
#include "terrain/lod/quadtree.h"

namespace groundray {

/// Triangle mesh of terrain on samples of its DEM, without T-junctions.
struct TerrainMesh {
  std::vector<glm::ivec2> vertices;   ///< column and row of a sample; each is used by a triangle
  std::vector<glm::uvec3> triangles;  ///< vertices, counter-clockwise in D as seen from above
  /// Level of each triangle: the legs of its cell are 2^level cells of the DEM long.
  std::vector<std::uint8_t> levels;
};

/// Returns the mesh of the coarsest quadtree that satisfies the bound, triangles of finer levels
/// first. A triangle exists if and only if its samples exist. Wherever the mesh exists, it deviates
/// from the reference surface by at most the bound, at samples and between them.
/// @param bound        bound.cell_m is taken from the grid.
/// @param block_cells  cells along a leaf's side: even, from 2 to Lattice::max_block_cells; 2 gives
///                     the fewest triangles.
/// @throws Error if block_cells is invalid, if the bound is negative or not a number, or if the
///         mesh has more vertices or triangles than 32 bits can number.
TerrainMesh build_terrain_mesh(const HeightGrid& grid, const MeshBound& bound, int block_cells = 2,
                               const PassRunner& runner = {});

}  // namespace groundray
