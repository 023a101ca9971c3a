// may_collapse and collapse are by hand: in Debian's library, OpenMesh's own are compiled with
// their assertions, and simplifying a fractal of 513 x 513 vertices takes 2.0 s with them, not 1.35
// s.
#include "reconstruction/mesh/simplify/star.h"

#include <algorithm>

namespace groundray {

void gather(const SurfaceMesh& mesh, std::uint32_t vertex, Star& star) {
  star.mesh = &mesh;
  star.centre = vertex;
  star.ring.clear();
  star.spokes.clear();
  // At a vertex on the boundary, OpenMesh stores the half-edge without a triangle: the last spoke.
  const auto stored = mesh.halfedge_handle(SurfaceMesh::VertexHandle(static_cast<int>(vertex)));
  const auto first = mesh.is_boundary(stored) ? mesh.ccw_rotated_halfedge_handle(stored) : stored;
  auto spoke = first;
  do {
    star.ring.push_back(number_of(mesh.to_vertex_handle(spoke)));
    star.spokes.push_back(spoke);
    spoke = mesh.ccw_rotated_halfedge_handle(spoke);
  } while (spoke != first);
}

bool may_collapse(const Star& star, std::size_t to) {
  const SurfaceMesh& mesh = *star.mesh;
  const auto along = star.spokes[to], back = mesh.opposite_halfedge_handle(along);
  const auto is_border = [&](auto h) { return mesh.is_boundary(mesh.opposite_halfedge_handle(h)); };
  std::uint32_t left = none, right = none;  // the corners opposite the edge
  if (!mesh.is_boundary(along)) {
    const auto next = mesh.next_halfedge_handle(along);
    if (is_border(next) && is_border(mesh.prev_halfedge_handle(along))) return false;
    left = number_of(mesh.to_vertex_handle(next));
  }
  if (!mesh.is_boundary(back)) {
    const auto next = mesh.next_halfedge_handle(back);
    if (is_border(next) && is_border(mesh.prev_halfedge_handle(back))) return false;
    right = number_of(mesh.to_vertex_handle(next));
  }
  if (left == right) return false;
  if (!star.is_open() && star.spokes.size() == 3) {  // the remaining triangle may exist already
    const auto beyond =
        mesh.opposite_halfedge_handle(mesh.next_halfedge_handle(star.spokes[(to + 1) % 3]));
    if (!mesh.is_boundary(beyond) &&
        number_of(mesh.to_vertex_handle(mesh.next_halfedge_handle(beyond))) == star.ring[to])
      return false;
  }
  // No other neighbour may be common.
  auto spoke = back;
  do {
    const std::uint32_t vertex = number_of(mesh.to_vertex_handle(spoke));
    if (vertex != left && vertex != right &&
        std::ranges::find(star.ring, vertex) != star.ring.end())
      return false;
    spoke = mesh.ccw_rotated_halfedge_handle(spoke);
  } while (spoke != back);
  return true;
}

void collapse(SurfaceMesh& mesh, const Star& star, std::size_t to) {
  const auto along = star.spokes[to], back = mesh.opposite_halfedge_handle(along);
  const auto centre = mesh.from_vertex_handle(along), target = mesh.to_vertex_handle(along);
  for (const auto spoke : star.spokes)
    mesh.set_vertex_handle(mesh.opposite_halfedge_handle(spoke), target);
  const auto remove = [&](auto h) {
    mesh.status(mesh.edge_handle(h)).set_deleted(true);
    mesh.status(h).set_deleted(true);
    mesh.status(mesh.opposite_halfedge_handle(h)).set_deleted(true);
  };
  // In a vanishing triangle, `stays` takes the place of the half-edge beyond `goes`.
  const auto close = [&](auto goes, auto stays) {
    const auto beyond = mesh.opposite_halfedge_handle(goes);
    const auto face = mesh.face_handle(beyond);
    mesh.status(mesh.face_handle(goes)).set_deleted(true);
    remove(goes);
    mesh.set_next_halfedge_handle(stays, mesh.next_halfedge_handle(beyond));
    mesh.set_next_halfedge_handle(mesh.prev_halfedge_handle(beyond), stays);
    mesh.set_face_handle(stays, face);
    if (face.is_valid() && mesh.halfedge_handle(face) == beyond)
      mesh.set_halfedge_handle(face, stays);
    // Two of the triangle's half-edges, or their opposites, begin at its third corner.
    const bool is_from_corner = mesh.to_vertex_handle(goes) == target;
    const auto vanishing = is_from_corner ? goes : beyond;
    const auto corner = mesh.from_vertex_handle(vanishing);
    if (mesh.halfedge_handle(corner) == vanishing) {
      mesh.set_halfedge_handle(corner,
                               is_from_corner ? mesh.opposite_halfedge_handle(stays) : stays);
    }
  };
  const bool is_left = !mesh.is_boundary(along), is_right = !mesh.is_boundary(back);
  const auto left = mesh.next_halfedge_handle(along);
  if (is_left) close(mesh.prev_halfedge_handle(along), left);
  if (is_right) close(mesh.next_halfedge_handle(back), mesh.prev_halfedge_handle(back));
  for (const auto h : {along, back}) {
    if (mesh.is_boundary(h))
      mesh.set_next_halfedge_handle(mesh.prev_halfedge_handle(h), mesh.next_halfedge_handle(h));
  }
  if (mesh.halfedge_handle(target) == back)
    mesh.set_halfedge_handle(target, is_right ? left : mesh.next_halfedge_handle(back));
  mesh.set_isolated(centre);
  mesh.status(centre).set_deleted(true);
  remove(along);
}

}  // namespace groundray
