#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/merge/cover_surface.h"
#include "reconstruction/merge/quilt.h"

namespace groundray {

/// Where an edge passes the border of a surface that covers one end of it.
struct BorderCrossing {
  std::uint32_t inside = 0, outside = 0;           ///< the edge's ends
  std::uint32_t from = no_vertex, to = no_vertex;  ///< of the edge of the border; none where the
                                                   ///< two part company away from any border
  double share = 0;                                ///< of the way along that edge, 0 and 1 included
};

/// How triangles lie to a surface.
struct BorderCrossings {
  std::vector<Cover> covers;              ///< of each vertex
  std::vector<BorderCrossing> crossings;  ///< one for each edge with just one end inside
};

/// Finds where edges cross a surface's border. Edges that cross it more than once get vertices
/// between the crossings first, as far as places about as far apart as the surface's own vertices
/// tell. Vertices that are not shared are not covered.
BorderCrossings find_border_crossings(Quilt& quilt, const CoverSurface& surface);

}  // namespace groundray
