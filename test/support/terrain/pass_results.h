#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/pass.h"
#include "terrain/lod/quadtree.h"
#include "terrain/terrain_mesh.h"

namespace groundray::testing {

/// Everything that the terrain's passes write for a DEM and a bound.
struct PassResults {
  std::vector<NodeLevel> levels;
  std::vector<std::vector<std::uint8_t>> states;  ///< of the nodes of each level
  std::vector<Leaf> leaves;
  TerrainMesh mesh;
};

/// Returns the grid with samples of its own, which other copies share.
HeightGrid deep_copy(const HeightGrid& grid);

PassResults results_of(const HeightGrid& grid, const MeshBound& bound, int block_cells,
                       const PassRunner& runner);

/// Returns the first array and element that differ, byte by byte; empty if all are equal.
std::string difference(const PassResults& found, const PassResults& expected);

}  // namespace groundray::testing
