#pragma once

#include <cstddef>

#include "core/geometry/mesh.h"

namespace groundray {

/// Numbers about the edges of a mesh, and its area.
struct MeshTopology {
  std::size_t boundary_edges = 0;      ///< edges of one triangle
  std::size_t non_manifold_edges = 0;  ///< edges of three triangles or more
  std::size_t reversed_edges = 0;      ///< edges of two triangles of opposite orientation
  double area_m2 = 0;
  double volume_m3 = 0;  ///< enclosed volume, if the mesh is closed; negative if it is inside out

  /// Returns true if the mesh encloses a volume: each edge has two triangles of one orientation.
  bool is_closed() const {
    return boundary_edges == 0 && non_manifold_edges == 0 && reversed_edges == 0;
  }
};

/// Computes the topology of a mesh whose triangles share the vertices at their common corners.
MeshTopology topology_of(const TriangleMesh& mesh);

}  // namespace groundray
