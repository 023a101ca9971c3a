// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
// drop_conflicts is by hand: of triangles in conflict at an edge, no function of CGAL keeps the
// earlier one. It takes 0.1 s for 2 million triangles.
#include "reconstruction/mesh/manifold_mesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/manifoldness.h>

#include <algorithm>
#include <boost/property_map/function_property_map.hpp>
#include <iterator>
#include <set>
#include <utility>

#include "reconstruction/mesh/surface_cgal.h"

namespace groundray {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

// Number of each triangle's piece, for CGAL to write.
struct PieceNumbers {
  using key_type = SurfaceMesh::FaceHandle;
  using value_type = std::uint32_t;
  using reference = value_type;
  using category = boost::writable_property_map_tag;

  std::vector<std::uint32_t>* numbers;

  friend void put(const PieceNumbers& pieces, key_type triangle, value_type piece) {
    (*pieces.numbers)[number_of(triangle)] = piece;
  }
};

std::size_t count_tangled_edges(const SurfaceMesh& surface) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto h : surface.halfedges()) {
    if (!surface.status(h).tagged()) continue;
    edges.insert(std::minmax(number_of(surface.from_vertex_handle(h)),
                             number_of(surface.to_vertex_handle(h))));
  }
  return edges.size();
}

}  // namespace

ManifoldMesh cut_to_manifold(const TriangleMesh& mesh) {
  const std::vector<bool> is_dropped = find_repeats(mesh.triangles, mesh.vertices_m.size());
  std::vector<glm::uvec3> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!is_dropped[i]) triangles.push_back(mesh.triangles[i]);
  }
  SurfaceMesh surface = to_surface(mesh.vertices_m, triangles);
  const std::size_t tangled_edges = count_tangled_edges(surface), copies = separate_fans(surface);
  surface.delete_isolated_vertices();
  RemainingMesh remaining = remaining_mesh(surface);
  return {.shape = std::move(remaining.mesh),
          .sources = std::move(remaining.sources),
          .tangled_edges = tangled_edges,
          .dropped = mesh.triangles.size() - triangles.size(),
          .copies = copies};
}

std::size_t separate_fans(SurfaceMesh& surface) {
  const std::size_t vertices = surface.n_vertices();
  std::vector<std::vector<SurfaceMesh::VertexHandle>> fans;  // of a vertex: itself and its copies
  pmp::duplicate_non_manifold_vertices(
      surface, CGAL::parameters::vertex_point_map(SurfacePoints<Kernel>{&surface})
                   .output_iterator(std::back_inserter(fans)));
  for (const std::vector<SurfaceMesh::VertexHandle>& same : fans) {
    for (const SurfaceMesh::VertexHandle vertex : same) {
      surface.adjust_outgoing_halfedge(vertex);  // to the one that OpenMesh asks for
      if (vertex == same.front()) continue;
      surface.data(vertex) = surface.data(same.front());
      surface.copy_all_properties(same.front(), vertex);
    }
  }
  return surface.n_vertices() - vertices;
}

std::size_t drop_conflicts(std::vector<glm::uvec3>& triangles, std::size_t vertices) {
  const auto corner = [&](std::uint32_t side) {
    return triangles[side / 3][static_cast<int>(side % 3)];
  };
  const auto end = [&](std::uint32_t side) { return corner(side % 3 == 2 ? side - 2 : side + 1); };
  const Buckets by_begin = sorted_in(vertices, 3 * triangles.size(), corner);
  std::vector<bool> is_out(triangles.size());
  const auto runs_as_an_earlier = [&](std::uint32_t side) {
    return std::ranges::any_of(by_begin.at(corner(side)), [&](std::uint32_t other) {
      return other / 3 < side / 3 && !is_out[other / 3] && end(other) == end(side);
    });
  };
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    is_out[i] = repeats_vertex(triangles[i]) || runs_as_an_earlier(3 * i) ||
                runs_as_an_earlier(3 * i + 1) || runs_as_an_earlier(3 * i + 2);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!is_out[i]) triangles[kept++] = triangles[i];
  }
  const std::size_t dropped = triangles.size() - kept;
  triangles.resize(kept);
  return dropped;
}

std::vector<std::uint32_t> number_pieces(const SurfaceMesh& surface, const EdgeCut& is_cut) {
  std::vector<std::uint32_t> numbers(surface.n_faces());
  using Edge = boost::graph_traits<SurfaceMesh>::edge_descriptor;
  const auto cuts = boost::make_function_property_map<Edge, bool>(
      [&](const Edge& edge) { return is_cut && is_cut(edge.halfedge()); });
  pmp::connected_components(surface, PieceNumbers{&numbers},
                            CGAL::parameters::edge_is_constrained_map(cuts));
  return numbers;
}

Buckets pieces_of(const SurfaceMesh& surface, const EdgeCut& is_cut) {
  const std::vector<std::uint32_t> numbers = number_pieces(surface, is_cut);
  const std::size_t pieces = numbers.empty() ? 0 : *std::ranges::max_element(numbers) + 1;
  return sorted_in(pieces, numbers.size(), [&](std::uint32_t i) { return numbers[i]; });
}

}  // namespace groundray
