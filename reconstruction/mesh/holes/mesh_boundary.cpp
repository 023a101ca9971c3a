// find_boundary is by hand, in 40 lines: CGAL's extract_boundary_cycles returns holes that touch at
// a vertex as a single cycle.
#include "reconstruction/mesh/holes/mesh_boundary.h"

#include <algorithm>
#include <array>
#include <compare>
#include <glm/geometric.hpp>
#include <set>
#include <utility>

#include "reconstruction/mesh/holes/hole_patch.h"

namespace groundray {
namespace {

std::uint32_t after(std::span<const std::uint32_t> chain, std::size_t i) {
  return chain[(i + 1) % chain.size()];
}

// Edges of a boundary and of an outline that may be joined.
struct Place {
  double sides_m = 0;  // length of the two outer sides of the triangles between them
  std::size_t on_boundary = 0, on_outline = 0;
  friend auto operator<=>(const Place&, const Place&) = default;
};

// Returns the closest candidates, closest first; none if the chains share a vertex.
std::vector<Place> near_places(const TriangleMesh& mesh, std::span<const std::uint32_t> boundary,
                               std::span<const std::uint32_t> outline) {
  constexpr std::ptrdiff_t most = 100;
  const auto apart_m = [&](std::uint32_t a, std::uint32_t b) {
    return glm::distance(mesh.vertices_m[a], mesh.vertices_m[b]);
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    for (std::size_t k = 0; k < outline.size(); ++k) {
      if (boundary[i] == outline[k]) return {};
      const double sides_m =
          apart_m(after(boundary, i), outline[k]) + apart_m(after(outline, k), boundary[i]);
      places.push_back({sides_m, i, k});
    }
  }
  const auto end = places.begin() + std::min(std::ssize(places), most);
  std::ranges::partial_sort(places, end);
  places.erase(end, places.end());
  return places;
}

// Returns the triangles between two edges if they face alike and intersect none at their corners.
std::vector<glm::uvec3> triangles_at(const TriangleMesh& mesh, const Buckets& stars,
                                     const std::array<std::uint32_t, 4>& corners) {
  const std::uint32_t a = corners[0], b = corners[1], c = corners[2], d = corners[3];
  TriangleMesh beside;
  const auto add = [&](const glm::uvec3& t) {
    const auto begin = static_cast<std::uint32_t>(beside.vertices_m.size());
    for (int k = 0; k < 3; ++k) beside.vertices_m.push_back(mesh.vertices_m[t[k]]);
    beside.triangles.emplace_back(begin, begin + 1, begin + 2);
  };
  std::set<std::uint32_t> taken;
  for (const std::uint32_t corner : corners) {
    for (const std::uint32_t triangle : stars.at(corner)) {
      if (taken.insert(triangle).second) add(mesh.triangles[triangle]);
    }
  }
  const auto first = static_cast<std::uint32_t>(beside.triangles.size());
  for (const auto& [one, other] : {std::pair(glm::uvec3(a, b, c), glm::uvec3(a, c, d)),
                                   std::pair(glm::uvec3(a, b, d), glm::uvec3(b, c, d))}) {
    if (!(glm::dot(area_vector_m2(mesh, one), area_vector_m2(mesh, other)) > 0)) continue;
    beside.triangles.resize(first);
    add(one);
    add(other);
    if (crossings(beside, first).empty()) return {one, other};
  }
  return {};
}

}  // namespace

std::vector<std::uint32_t> vertices_of(const SurfaceMesh& surface, const BoundaryLoop& loop) {
  std::vector<std::uint32_t> vertices;
  for (const auto h : loop) vertices.push_back(number_of(surface.from_vertex_handle(h)));
  return vertices;
}

void link(SurfaceMesh& surface, SurfaceMesh::HalfedgeHandle half_edge,
          SurfaceMesh::HalfedgeHandle next) {
  const auto after = surface.next_halfedge_handle(half_edge);
  const auto before = surface.prev_halfedge_handle(next);
  surface.set_next_halfedge_handle(half_edge, next);
  surface.set_next_halfedge_handle(before, after);
}

std::vector<BoundaryLoop> find_boundary(SurfaceMesh& surface) {
  std::vector<BoundaryLoop> loops;
  std::vector<std::uint32_t> places(surface.n_vertices(), none);  // in `walk`, by first vertex
  std::vector<bool> is_seen(surface.n_halfedges());
  BoundaryLoop whole, walk;
  const auto close = [&](std::size_t place) {  // the part of the walk from there on
    BoundaryLoop loop(walk.begin() + static_cast<std::ptrdiff_t>(place), walk.end());
    walk.resize(place);
    for (const std::uint32_t vertex : vertices_of(surface, loop)) places[vertex] = none;
    link(surface, loop.back(), loop.front());
    loops.push_back(std::move(loop));
  };
  for (const auto first : surface.halfedges()) {
    if (!surface.is_boundary(first) || is_seen[number_of(first)] ||
        surface.status(surface.opposite_face_handle(first)).tagged())
      continue;
    whole.clear();
    for (SurfaceMesh::HalfedgeHandle h = first; !is_seen[number_of(h)];
         h = surface.next_halfedge_handle(h)) {
      is_seen[number_of(h)] = true;
      whole.push_back(h);
    }
    for (const auto h : whole) {
      std::uint32_t& place = places[number_of(surface.from_vertex_handle(h))];
      if (place != none) close(place);
      place = static_cast<std::uint32_t>(walk.size());
      walk.push_back(h);
    }
    close(0);
  }
  return loops;
}

Buckets stars_of(const SurfaceMesh& surface) {
  Buckets corners = sorted_in(surface.n_vertices(), 3 * surface.n_faces(), [&](auto corner) {
    const auto triangle = surface.face_handle(corner / 3);
    if (surface.status(triangle).tagged()) return none;
    const auto h = half_edge_of(surface, corner / 3, static_cast<int>(corner % 3));
    return number_of(surface.from_vertex_handle(h));
  });
  for (std::uint32_t& item : corners.items) item /= 3;
  return corners;
}

std::optional<BridgedBoundary> bridge(const TriangleMesh& mesh, const Buckets& stars,
                                      BridgedBoundary boundary,
                                      std::span<const std::uint32_t> outline) {
  for (const Place& place : near_places(mesh, boundary.vertices, outline)) {
    const std::size_t at = place.on_boundary, to = place.on_outline;
    const std::vector<glm::uvec3> triangles = triangles_at(
        mesh, stars,
        {boundary.vertices[at], after(boundary.vertices, at), outline[to], after(outline, to)});
    if (triangles.empty()) continue;
    boundary.bridges.insert(boundary.bridges.end(), triangles.begin(), triangles.end());
    std::vector<std::uint32_t> round(outline.begin(), outline.end());
    std::ranges::rotate(round,
                        round.begin() + static_cast<std::ptrdiff_t>(to + 1) % std::ssize(round));
    boundary.vertices.insert(boundary.vertices.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                             round.begin(), round.end());
    return boundary;
  }
  return std::nullopt;
}

}  // namespace groundray
