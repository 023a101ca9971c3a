#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/mesh/merge/cover_surface.h"
#include "reconstruction/mesh/merge/stitched_mesh.h"

namespace groundray {

/// Crossing of an edge with the boundary of a surface that covers one of its ends.
struct BorderCrossing {
  std::uint32_t inside = 0, outside = 0;  ///< ends of the edge
  /// Ends of the boundary edge; `no_vertex` where edge and surface separate away from a boundary.
  std::uint32_t from = no_vertex, to = no_vertex;
  double share = 0;  ///< position along the boundary edge, 0 to 1
};

/// Coverage of a merged mesh's vertices by a surface, and crossings of its edges.
struct BorderCrossings {
  std::vector<Cover> covers;              ///< of each vertex
  std::vector<BorderCrossing> crossings;  ///< one for each edge with exactly one end inside
};

/// Finds the crossings of edges with a surface's boundary. Edges that cross it more than once are
/// first split between the crossings, as far as samples a few triangle sizes apart show these.
/// Vertices that are not shared count as not covered.
BorderCrossings find_border_crossings(StitchedMesh& stitched, const CoverSurface& surface);

}  // namespace groundray
