#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/mesh_arrays.h"
#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

/// Boundary half-edges that follow one another; none passes a vertex twice.
using BoundaryLoop = std::vector<SurfaceMesh::HalfedgeHandle>;

/// Returns the vertices at which the half-edges of a loop begin.
std::vector<std::uint32_t> vertices_of(const SurfaceMesh& surface, const BoundaryLoop& loop);

/// Makes `next` the successor of a boundary half-edge; it must begin where that one ends. The
/// former successor of the one and predecessor of the other become neighbours, so that all
/// boundaries stay closed.
void link(SurfaceMesh& surface, SurfaceMesh::HalfedgeHandle half_edge,
          SurfaceMesh::HalfedgeHandle next);

/// Links the boundaries of a surface so that none passes a vertex twice, and returns them, without
/// those of tagged triangles. Where several touch at a vertex, each is a loop of its own.
std::vector<BoundaryLoop> find_boundary(SurfaceMesh& surface);

/// Groups the triangles of a surface by vertex, without tagged ones.
Buckets stars_of(const SurfaceMesh& surface);

/// Boundary of a hole, joined with the outlines of pieces of surface inside it to a single loop.
struct BridgedBoundary {
  std::vector<std::uint32_t> vertices;
  std::vector<glm::uvec3> bridges;  ///< two triangles per piece, by the mesh's vertices
};

/// Joins an outline to a boundary by two triangles at a position where both are close and the
/// triangles intersect none of their neighbours.
/// @param stars              as from stars_of.
/// @param boundary, outline  vertices, in the winding order of triangles that fill them.
/// @return nothing if they share a vertex or there is no such position.
std::optional<BridgedBoundary> bridge(const TriangleMesh& mesh, const Buckets& stars,
                                      BridgedBoundary boundary,
                                      std::span<const std::uint32_t> outline);

}  // namespace groundray
