#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/leaf.h"
#include "core/tracing/level.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/pass.h"
#include "terrain/lod/quadtree.h"
#include "terrain/terrain_mesh.h"
#include "test/support/terrain/slow_quadtree.h"

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

/// Leaves and mesh of each level of a clipmap, or of other nested windows.
struct WindowResults {
  std::vector<std::vector<Leaf>> leaves;
  std::vector<TerrainMesh> meshes;
};

/// Returns the levels of nested windows with blocks of any size.
std::vector<Level> levels_of(const HeightGrid& grid, const Known& known, const Selection& selection,
                             const PassRunner& runner = {});

/// Results for windows round a position, `side` nodes wide (see Known::show_windows_round).
WindowResults window_results(const HeightGrid& grid, glm::dvec2 place, int side,
                             const MeshBound& bound, int block_cells, const PassRunner& runner);

/// Results for a clipmap with small windows that is built at the first of some places and moved to
/// the others.
std::vector<WindowResults> clipmap_results(const HeightGrid& grid, double tolerance_m,
                                           double angle_rad, std::span<const glm::dvec3> places,
                                           const PassRunner& runner);

/// Returns places near a corner of the DEM, some cells from there, and in the far corner.
std::vector<glm::dvec3> places_on(const HeightGrid& grid);

/// Returns the first array and element that differ, byte by byte; empty if all are equal.
std::string difference(const PassResults& found, const PassResults& expected);
std::string difference(const WindowResults& found, const WindowResults& expected);
std::string difference(const std::vector<WindowResults>& found,
                       const std::vector<WindowResults>& expected);

}  // namespace groundray::testing
