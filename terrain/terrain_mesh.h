#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/level.h"
#include "terrain/lod/clipmap.h"
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

/// Returns the mesh of each level of a clipmap, with all of its vertices: those on the border of
/// two windows belong to both meshes. Together the meshes are one surface without cracks or
/// T-junctions. A triangle exists if and only if its samples exist.
/// @param levels  finest first, with all leaves of `selection`: Clipmap::levels, and
///                Clipmap::selection.
/// @throws Error if a mesh has more vertices or triangles than 32 bits can number.
std::vector<TerrainMesh> build_level_meshes(const Selection& selection,
                                            std::span<const Level> levels,
                                            const PassRunner& runner = {});

/// Returns the mesh of each level of a clipmap.
inline std::vector<TerrainMesh> build_level_meshes(const Clipmap& clipmap,
                                                   const PassRunner& runner = {}) {
  return build_level_meshes(clipmap.selection(), clipmap.levels(), runner);
}

}  // namespace groundray
