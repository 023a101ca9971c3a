// Triangles are joined by hand, because libraries would change them: OpenMesh's add_face rejects
// those at edges and vertices that are not manifold, and CGAL's orient_polygon_soup turns triangles
// over. A grid of 2 million triangles takes 0.13 s here, 0.26 s with add_face, and 1.2 s with CGAL.
#include "reconstruction/mesh/surface_mesh.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

// Number of an edge of a triangle: 3 * triangle + k leads from corner k to the next.
using Side = std::uint32_t;

constexpr Side next_of(Side side) { return side % 3 == 2 ? side - 2 : side + 1; }

std::uint32_t begin_of(std::span<const glm::uvec3> triangles, Side side) {
  return triangles[side / 3][static_cast<int>(side % 3)];
}

// Rotates the vertices so that the smallest comes first: equal for triangles that differ only in
// their first corner.
std::array<std::uint32_t, 3> rotated(const glm::uvec3& t) {
  if (t.x <= t.y && t.x <= t.z) return {t.x, t.y, t.z};
  if (t.y <= t.z) return {t.y, t.z, t.x};
  return {t.z, t.x, t.y};
}

// Edges between triangles.
struct Joints {
  std::vector<Side> twins;        // of each side: the other side of its edge; none at a boundary
  std::vector<bool> is_tangled;   // of each side: its edge is not manifold
  std::vector<bool> is_left_out;  // of each triangle
};

// Joins two sides with the same ends if they are the only ones and run in opposite directions.
void join(std::span<const glm::uvec3> triangles, std::span<const Side> sides, Joints& joints) {
  if (sides.size() == 2 && begin_of(triangles, sides[0]) != begin_of(triangles, sides[1])) {
    joints.twins[sides[0]] = sides[1];
    joints.twins[sides[1]] = sides[0];
  } else if (sides.size() > 1) {
    for (const Side side : sides) joints.is_tangled[side] = true;
  }
}

Joints find_joints(std::span<const glm::uvec3> triangles, std::size_t vertices) {
  Joints joints{.twins = std::vector<Side>(3 * triangles.size(), none),
                .is_tangled = std::vector<bool>(3 * triangles.size()),
                .is_left_out = find_repeats(triangles, vertices)};
  const auto ends = [&](Side side) {
    return std::minmax({begin_of(triangles, side), begin_of(triangles, next_of(side))});
  };
  const Buckets by_lesser = sorted_in(vertices, 3 * triangles.size(), [&](Side side) {
    return joints.is_left_out[side / 3] ? none : ends(side).first;
  });
  std::vector<std::pair<std::uint32_t, Side>> here;  // larger end first
  std::vector<Side> alike;
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    here.clear();
    for (const Side side : by_lesser.at(vertex)) here.emplace_back(ends(side).second, side);
    std::ranges::sort(here);
    for (std::size_t k = 0; k < here.size();) {
      alike.clear();
      const std::uint32_t greater = here[k].first;
      for (; k < here.size() && here[k].first == greater; ++k) alike.push_back(here[k].second);
      join(triangles, alike, joints);
    }
  }
  return joints;
}

// Links the half-edges of boundaries: each is followed by the next one of the same fan.
void link_boundaries(SurfaceMesh& surface) {
  for (const auto border : surface.halfedges()) {
    if (!surface.is_boundary(border)) continue;
    auto inner = surface.opposite_halfedge_handle(border);  // turned about its begin
    do {
      inner = surface.opposite_halfedge_handle(surface.prev_halfedge_handle(inner));
    } while (!surface.is_boundary(inner));
    surface.set_next_halfedge_handle(border, inner);
  }
}

// Names of the vertices' properties.
constexpr const char *sd_name = "sd_m", *label_name = "label", *confidence_name = "confidence";

template <typename Value>
void put_property(SurfaceMesh& surface, const char* name, const std::vector<Value>& values) {
  if (values.empty()) return;
  OpenMesh::VPropHandleT<Value> property;
  surface.add_property(property, name);
  for (const auto vertex : surface.vertices())
    surface.property(property, vertex) = values[number_of(vertex)];
}

// Returns the values of a property at the vertices that were not deleted; none if it does not
// exist.
template <typename Value>
std::vector<Value> property_of(const SurfaceMesh& surface, const char* name) {
  std::vector<Value> values;
  OpenMesh::VPropHandleT<Value> property;
  if (!surface.get_property_handle(property, name)) return values;
  for (const auto vertex : surface.vertices()) values.push_back(surface.property(property, vertex));
  return values;
}

}  // namespace

std::vector<bool> find_repeats(std::span<const glm::uvec3> triangles, std::size_t vertices) {
  std::vector<bool> is_repeat(triangles.size());
  const Buckets by_least = sorted_in(
      vertices, triangles.size(), [&](std::uint32_t i) { return rotated(triangles[i]).front(); });
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> alike;
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    alike.clear();
    for (const std::uint32_t i : by_least.at(vertex)) alike.emplace_back(rotated(triangles[i]), i);
    std::ranges::sort(alike);
    for (std::size_t k = 0; k < alike.size(); ++k) {
      const auto& [corners, triangle] = alike[k];
      is_repeat[triangle] =
          repeats_vertex(triangles[triangle]) || (k > 0 && alike[k - 1].first == corners);
    }
  }
  return is_repeat;
}

SurfaceMesh to_surface(std::span<const glm::dvec3> points_m,
                       std::span<const glm::uvec3> triangles) {
  if (triangles.size() >= most_triangles) {
    throw Error("mesh: {} triangles must be fewer than {}; split the mesh", triangles.size(),
                most_triangles);
  }
  const Joints joints = find_joints(triangles, points_m.size());
  const std::vector<Side>& twins = joints.twins;
  const auto borders = static_cast<std::size_t>(std::count(twins.begin(), twins.end(), none));
  SurfaceMesh surface;
  surface.resize(points_m.size(), (twins.size() + borders) / 2, triangles.size());
  const auto begin_vertex = [&](Side side) {
    return SurfaceMesh::VertexHandle(static_cast<int>(begin_of(triangles, side)));
  };
  for (std::uint32_t i = 0; i < points_m.size(); ++i) {
    const SurfaceMesh::VertexHandle vertex(static_cast<int>(i));
    surface.set_point(vertex, points_m[i]);
    surface.data(vertex).source = i;
  }
  std::vector<SurfaceMesh::HalfedgeHandle> handles(twins.size());
  int edges = 0;
  for (Side side = 0; side < twins.size(); ++side) {
    const bool is_first = twins[side] == none || side < twins[side];
    handles[side] = is_first ? surface.halfedge_handle(SurfaceMesh::EdgeHandle(edges++), 0)
                             : surface.opposite_halfedge_handle(handles[twins[side]]);
    surface.set_vertex_handle(handles[side], begin_vertex(next_of(side)));
    surface.set_vertex_handle(surface.opposite_halfedge_handle(handles[side]), begin_vertex(side));
  }
  for (Side side = 0; side < twins.size(); ++side) {
    const SurfaceMesh::FaceHandle triangle(static_cast<int>(side / 3));
    if (side % 3 == 2) surface.set_halfedge_handle(triangle, handles[side]);
    surface.set_next_halfedge_handle(handles[side], handles[next_of(side)]);
    surface.set_face_handle(handles[side], triangle);
    surface.status(handles[side]).set_tagged(joints.is_tangled[side]);
    surface.status(triangle).set_tagged(joints.is_left_out[side / 3]);
    if (!joints.is_left_out[side / 3])
      surface.set_halfedge_handle(begin_vertex(side), handles[side]);
  }
  link_boundaries(surface);
  for (Side side = 0; side < twins.size(); ++side) {  // as OpenMesh asks of vertices at boundaries
    if (twins[side] == none && !joints.is_left_out[side / 3])
      surface.set_halfedge_handle(begin_vertex(next_of(side)),
                                  surface.opposite_halfedge_handle(handles[side]));
  }
  return surface;
}

RemainingMesh remaining_mesh(const SurfaceMesh& surface) {
  RemainingMesh out;
  out.numbers.assign(surface.n_vertices(), none);
  for (const auto vertex : surface.vertices()) {  // skips what was deleted
    out.numbers[number_of(vertex)] = static_cast<std::uint32_t>(out.sources.size());
    out.sources.push_back(source_of(surface, vertex));
    out.mesh.vertices_m.push_back(surface.point(vertex));
  }
  for (const auto face : surface.faces()) {
    const glm::uvec3 t = corners_of(surface, number_of(face));
    out.mesh.triangles.emplace_back(out.numbers[t.x], out.numbers[t.y], out.numbers[t.z]);
  }
  return out;
}

SurfaceMesh to_surface(const MeasuredMesh& mesh) {
  SurfaceMesh surface = to_surface(mesh.shape);
  put_property(surface, sd_name, mesh.sd_m);
  put_property(surface, label_name, mesh.labels);
  put_property(surface, confidence_name, mesh.confidence);
  return surface;
}

MeasuredMesh remaining_measured_mesh(const SurfaceMesh& surface) {
  return {.shape = remaining_mesh(surface).mesh,
          .sd_m = property_of<float>(surface, sd_name),
          .labels = property_of<std::uint16_t>(surface, label_name),
          .confidence = property_of<float>(surface, confidence_name)};
}

}  // namespace groundray
