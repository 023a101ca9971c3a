#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/lod/lattice.h"
#include "test/support/real.h"
#include "test/support/terrain/leaf_triangles.h"

namespace groundray::testing {

/// Returns true if all three samples have heights.
bool exists(const HeightGrid& grid, const SampleTriangle& triangle);

/// Returns the triangles of a block of cells whose sides `thinned` (bits of Leaf::Side) have
/// coarser neighbours, on points of its own lattice, as the templates are drawn in
/// docs/theory/terrain.md.
std::vector<SampleTriangle> template_triangles(glm::ivec2 cells, unsigned thinned);

/// Largest vertical distances between a node and the reference surface, metres.
struct NodeDeviations {
  Real full = 0;  ///< with no side thinned
  Real all = 0;   ///< over all templates that its neighbours can require
};

/// Certifies one node by intersecting each triangle of each template with each facet below it.
NodeDeviations certify_slowly(const HeightGrid& grid, const Lattice& lattice, int level,
                              glm::ivec2 node);

}  // namespace groundray::testing
