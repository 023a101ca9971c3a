#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {

/// Triangles in CGAL's half-edge structure; `Mesh` is a CGAL::Surface_mesh.
template <typename Mesh>
struct HalfEdgeMesh {
  Mesh mesh;                                              ///< vertices and faces in the input order
  std::vector<typename Mesh::Halfedge_index> half_edges;  ///< of each input half-edge
};

/// Builds a half-edge structure from paired edges. Adding face by face would reject boundaries that
/// touch at a vertex.
/// @param next_border  returns, for a boundary half-edge, the one that ends where it begins, as
///                     groundray::next_border.
template <typename Mesh, typename NextBorder>
HalfEdgeMesh<Mesh> half_edge_mesh(std::span<const glm::dvec3> points_m,
                                  std::span<const glm::uvec3> triangles, const EdgePairs& pairs,
                                  const NextBorder& next_border) {
  using Vertex = typename Mesh::Vertex_index;
  HalfEdgeMesh<Mesh> out;
  Mesh& mesh = out.mesh;
  const auto vertices = static_cast<std::uint32_t>(points_m.size());
  const auto faces = static_cast<std::uint32_t>(triangles.size());
  mesh.reserve(vertices, 3 * faces / 2 + vertices, faces);
  for (const glm::dvec3& p : points_m) mesh.add_vertex({p.x, p.y, p.z});
  out.half_edges.resize(3 * triangles.size());
  const auto corner = [&](HalfEdge h) { return Vertex(triangles[h / 3][static_cast<int>(h % 3)]); };
  for (HalfEdge h = 0; h < out.half_edges.size(); ++h) {
    const HalfEdge twin = pairs.twins[h];
    const bool is_new = twin == none || h < twin;
    out.half_edges[h] =
        is_new ? mesh.add_edge(corner(h), corner(next_of(h))) : mesh.opposite(out.half_edges[twin]);
  }
  for (std::uint32_t t = 0; t < faces; ++t) {
    const auto face = mesh.add_face();
    mesh.set_halfedge(face, out.half_edges[3 * t + 2]);  // ends at the first corner
  }
  for (HalfEdge h = 0; h < out.half_edges.size(); ++h) {
    const auto half_edge = out.half_edges[h];
    mesh.set_next(half_edge, out.half_edges[next_of(h)]);
    mesh.set_face(half_edge, typename Mesh::Face_index(h / 3));
    if (!mesh.halfedge(corner(next_of(h))).is_valid())
      mesh.set_halfedge(corner(next_of(h)), half_edge);
  }
  for (HalfEdge h = 0; h < out.half_edges.size(); ++h) {
    if (pairs.twins[h] != none) continue;
    const auto border = mesh.opposite(out.half_edges[h]);
    mesh.set_next(border, mesh.opposite(out.half_edges[next_border(h)]));
    mesh.set_halfedge(corner(h), border);  // as CGAL requires of boundary vertices
  }
  return out;
}

}  // namespace groundray
