#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/leaf.h"

namespace groundray {

/// Memory of a cell in grids, bytes: sample, vertices, primitives and BVH, measured on terrain
/// without holes.
inline constexpr double grid_cell_bytes = 40;
/// Memory of a cell as a quad, likewise.
inline constexpr double quad_cell_bytes = 150;

/// Part of a terrain that one level scene holds: leaves of its quadtree, and their samples. Its
/// window is the rectangle of those samples.
struct Level {
  GridFrame frame;      ///< of the DEM; the same for all levels of a tracer
  HeightArray heights;  ///< every step-th sample of the DEM from `first` on, and the DEM's last
                        ///< column or row where the window reaches it
  glm::ivec2 first{0};  ///< the DEM's sample at heights(0, 0); multiples of step
  int step = 1;         ///< of the finest leaves, in cells of the DEM; a power of two
  int leaf_cells = 8;   ///< side of a leaf in its own cells; a power of two
  /// Side, in cells of `step`, of the parts that are built and reused one by one; a power of two,
  /// or 0 for a single part.
  int part_cells = 0;
  /// True if Embree holds ordinary cells as quads, which are faster, instead of grids of up to a
  /// leaf, which take less memory: see docs/theory/surface.md.
  bool has_quads = false;
  std::vector<Leaf> leaves;  ///< they tile the window except for that of the next finer level
};

}  // namespace groundray
