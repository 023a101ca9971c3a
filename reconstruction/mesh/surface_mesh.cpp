#include "reconstruction/mesh/surface_mesh.h"

#include <algorithm>

namespace groundray {

SurfaceMesh to_surface(std::span<const glm::dvec3> points_m, std::span<const glm::uvec3> triangles,
                       const EdgePairs& pairs,
                       const std::function<HalfEdge(HalfEdge)>& next_border) {
  const auto borders =
      static_cast<std::size_t>(std::count(pairs.twins.begin(), pairs.twins.end(), none));
  SurfaceMesh surface;
  surface.resize(points_m.size(), (3 * triangles.size() + borders) / 2, triangles.size());
  std::vector<SurfaceMesh::HalfedgeHandle> handles(3 * triangles.size());
  const auto corner = [&](HalfEdge h) {
    return SurfaceMesh::VertexHandle(static_cast<int>(corner_of(triangles, h)));
  };
  for (std::size_t i = 0; i < points_m.size(); ++i)
    surface.set_point(SurfaceMesh::VertexHandle(static_cast<int>(i)), points_m[i]);
  int edges = 0;
  for (HalfEdge h = 0; h < handles.size(); ++h) {
    const HalfEdge twin = pairs.twins[h];
    handles[h] = twin == none || h < twin
                     ? surface.halfedge_handle(SurfaceMesh::EdgeHandle(edges++), 0)
                     : surface.opposite_halfedge_handle(handles[twin]);
    surface.set_vertex_handle(handles[h], corner(next_of(h)));
    surface.set_vertex_handle(surface.opposite_halfedge_handle(handles[h]), corner(h));
  }
  for (HalfEdge h = 0; h < handles.size(); ++h) {
    const SurfaceMesh::FaceHandle face(static_cast<int>(h / 3));
    if (h % 3 == 2) surface.set_halfedge_handle(face, handles[h]);
    surface.set_next_halfedge_handle(handles[h], handles[next_of(h)]);
    surface.set_face_handle(handles[h], face);
    surface.set_halfedge_handle(corner(h), handles[h]);
  }
  for (HalfEdge h = 0; h < handles.size(); ++h) {
    if (pairs.twins[h] != none) continue;
    const auto border = surface.opposite_halfedge_handle(handles[h]);
    surface.set_next_halfedge_handle(border,
                                     surface.opposite_halfedge_handle(handles[next_border(h)]));
    surface.set_halfedge_handle(corner(next_of(h)), border);  // as boundary vertices require
  }
  return surface;
}

SurfaceMesh to_surface(const TriangleMesh& shape, const EdgePairs& pairs) {
  return to_surface(shape.vertices_m, shape.triangles, pairs,
                    [&](HalfEdge h) { return next_border(pairs, h); });
}

SurfaceMesh::HalfedgeHandle handle_of(const SurfaceMesh& surface, HalfEdge h) {
  auto handle = surface.halfedge_handle(SurfaceMesh::FaceHandle(static_cast<int>(h / 3)));
  for (HalfEdge k = 0; k < (h + 1) % 3; ++k) handle = surface.next_halfedge_handle(handle);
  return handle;
}

RemainingMesh remaining_mesh(const SurfaceMesh& surface) {
  RemainingMesh out;
  out.numbers.assign(surface.n_vertices(), none);
  for (const auto vertex : surface.vertices()) {  // skips what was deleted
    out.numbers[number_of(vertex)] = static_cast<std::uint32_t>(out.sources.size());
    out.sources.push_back(number_of(vertex));
    out.mesh.vertices_m.push_back(surface.point(vertex));
  }
  for (const auto face : surface.faces()) {
    const glm::uvec3 t = corners_of(surface, number_of(face));
    out.mesh.triangles.emplace_back(out.numbers[t.x], out.numbers[t.y], out.numbers[t.z]);
  }
  return out;
}

}  // namespace groundray
