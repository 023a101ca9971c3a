#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/height_grid.h"
#include "terrain/pass.h"
#include "terrain/quadtree.h"

namespace groundray {

/// A triangle mesh of terrain on samples of its DEM, without T-junctions.
struct TerrainMesh {
  std::vector<glm::ivec2> vertices;   ///< column and row of a sample; each is used by a triangle
  std::vector<glm::uvec3> triangles;  ///< vertices, counter-clockwise in D as seen from above
  /// Level of each triangle: the legs of its cell are 2^level cells of the DEM long.
  std::vector<std::uint8_t> levels;
};

/// Returns the mesh of the coarsest quadtree that keeps the bound, triangles of finer levels first.
/// At level l a triangle exists iff its samples do; nowhere else is the mesh farther than the bound
/// from the reference surface, at samples or between them.
/// @param bound        bound.cell_m is taken from the grid.
/// @param block_cells  cells along a leaf's side: even, from 2 to Lattice::max_block_cells; 2
///                     gives the fewest triangles.
/// @throws Error if block_cells is none of these, the bound negative or not a number, or the
///         mesh has more vertices or triangles than 32 bits can number.
TerrainMesh build_terrain_mesh(const HeightGrid& grid, const MeshBound& bound, int block_cells = 2,
                               const PassRunner& runner = run_in_parallel);

}  // namespace groundray
