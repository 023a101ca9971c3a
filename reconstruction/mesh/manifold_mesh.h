#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

/// Mesh in which each edge has one or two consistently wound triangles, and each vertex one fan.
struct ManifoldMesh {
  TriangleMesh shape;                  ///< without levels, unused vertices and dropped triangles
  std::vector<std::uint32_t> sources;  ///< of each vertex: its number in the original
  /// Edges with more than two triangles, or two in the same direction. The fans beside them got
  /// vertices of their own; at most two triangles still share both ends, and they are joined.
  std::size_t tangled_edges = 0;
  std::size_t dropped = 0;  ///< triangles that repeated a vertex or another triangle
  std::size_t copies = 0;   ///< vertices added because the original joined several fans
};

/// Cuts a mesh open where it is not manifold. The mesh must satisfy check_mesh. No vertex moves,
/// and manifold parts stay as they are, except that unused vertices are removed. The result is a
/// manifold although two triangles that were cut apart may share both ends of an edge again: a fan
/// that ends at the edge enters it on one side and leaves it on the other, so there are no more
/// than two, in opposite directions.
ManifoldMesh cut_to_manifold(const TriangleMesh& mesh);

/// Gives each fan of triangles at a vertex a vertex of its own, with the same source and
/// properties; the fan of the half-edge with the lowest number keeps the original. Added vertices
/// follow the others. Returns their number.
/// @param surface  without tagged triangles, which would count as fans.
std::size_t separate_fans(SurfaceMesh& surface);

/// Removes triangles that repeat a vertex, and those that traverse an edge in the same direction as
/// an earlier one, so that no edge is tangled. Returns the number of removed triangles.
/// @param vertices  number of vertices.
std::size_t drop_conflicts(std::vector<glm::uvec3>& triangles, std::size_t vertices);

/// Returns true for an edge, given by one of its half-edges, that connects nothing.
using EdgeCut = std::function<bool(SurfaceMesh::HalfedgeHandle)>;

/// Numbers the pieces of a surface, whose triangles are connected by edges, from 0 in the order of
/// their first triangles.
/// @return the number of each triangle's piece.
std::vector<std::uint32_t> number_pieces(const SurfaceMesh& surface, const EdgeCut& is_cut = {});

/// Groups the triangles of a surface by piece; see number_pieces.
Buckets pieces_of(const SurfaceMesh& surface, const EdgeCut& is_cut = {});

}  // namespace groundray
