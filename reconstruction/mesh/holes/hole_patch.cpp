// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
// crossings is by hand, from CGAL's predicates and boxes: it tests 1000 triangles against a million
// in 0.6 s. CGAL's self_intersections tests all pairs, in 4.9 s.
#include "reconstruction/mesh/holes/hole_patch.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/fair.h>
#include <CGAL/Polygon_mesh_processing/refine.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/version.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <unordered_map>

#include "reconstruction/mesh/surface_cgal.h"

namespace groundray {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Faces = std::vector<SurfaceMesh::FaceHandle>;
using Vertices = std::vector<SurfaceMesh::VertexHandle>;
using Corners = std::array<glm::dvec3, 3>;

// Bounding box of a triangle, as CGAL requires.
struct Box : CGAL::Box_intersection_d::Box_d<double, 3, CGAL::Box_intersection_d::ID_NONE> {
  std::uint32_t triangle;

  Box(const Corners& at, std::uint32_t number)
      : Box_d(CGAL::Bbox_3(least(at).x, least(at).y, least(at).z, most(at).x, most(at).y,
                           most(at).z)),
        triangle(number) {}
  std::uint32_t id() const { return triangle; }

 private:
  static glm::dvec3 least(const Corners& at) { return glm::min(at[0], glm::min(at[1], at[2])); }
  static glm::dvec3 most(const Corners& at) { return glm::max(at[0], glm::max(at[1], at[2])); }
};

Point to_cgal(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

Kernel::Triangle_3 triangle_of(const Corners& at) {
  return {to_cgal(at[0]), to_cgal(at[1]), to_cgal(at[2])};
}

bool is_needle(const Corners& at) {
  return CGAL::collinear(to_cgal(at[0]), to_cgal(at[1]), to_cgal(at[2]));
}

// Moves the corners that both share to the front, in the same order, and returns their number.
std::size_t align(Corners& a, Corners& b) {
  std::size_t shared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found = std::find(b.begin() + static_cast<std::ptrdiff_t>(shared), b.end(), a[i]);
    if (found == b.end()) continue;
    std::iter_swap(found, b.begin() + static_cast<std::ptrdiff_t>(shared));
    std::swap(a[i], a[shared]);
    ++shared;
  }
  return shared;
}

bool reaches(const Corners& triangle, const Corners& far) {
  return CGAL::do_intersect(triangle_of(triangle),
                            Kernel::Segment_3(to_cgal(far[1]), to_cgal(far[2])));
}

bool do_cross(Corners a, Corners b) {
  if (is_needle(a) || is_needle(b)) return false;
  switch (align(a, b)) {
    case 0:
      return CGAL::do_intersect(triangle_of(a), triangle_of(b));
    case 1:  // the edge opposite to the shared corner must not touch the other triangle
      return reaches(a, b) || reaches(b, a);
    case 2: {
      const Point p = to_cgal(a[0]), q = to_cgal(a[1]), r = to_cgal(a[2]), s = to_cgal(b[2]);
      return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
    }
    default:
      return true;
  }
}

// Triangles around a hole. The vertices of the boundary come first.
class Surroundings {
 public:
  Surroundings(const AdjacentMesh& at, const BoundaryLoop& loop) : at_(at), loop_(loop) {
    for (const std::uint32_t vertex : vertices_of(at.surface, loop)) number(vertex);
    origin_m_ = at.mesh.vertices_m[vertices_.front()];
    constexpr int rings = 3;  // fairing uses two
    std::size_t begin = 0;
    for (int ring = 0; ring < rings; ++ring) {
      const std::size_t end = vertices_.size();
      for (; begin < end; ++begin) add_star(vertices_[begin]);
    }
  }

  const glm::dvec3& origin_m() const { return origin_m_; }
  std::uint32_t vertices() const { return static_cast<std::uint32_t>(vertices_.size()); }

  SurfaceMesh surface() const {
    std::vector<glm::dvec3> points_m;
    for (const std::uint32_t vertex : vertices_)
      points_m.push_back(at_.mesh.vertices_m[vertex] - origin_m_);
    std::vector<glm::uvec3> triangles;
    for (const std::uint32_t triangle : triangles_) {
      const glm::uvec3& t = at_.mesh.triangles[triangle];
      triangles.emplace_back(numbers_.at(t.x), numbers_.at(t.y), numbers_.at(t.z));
    }
    SurfaceMesh surface = to_surface(points_m, triangles);
    for (std::size_t i = 0; i < loop_.size(); ++i)
      link(surface, local(surface, i), local(surface, (i + 1) % loop_.size()));
    return surface;
  }

  // Returns the half-edge of the surface that is number i of the loop.
  SurfaceMesh::HalfedgeHandle local(const SurfaceMesh& surface, std::size_t i) const {
    const std::uint32_t outside = triangle_across(at_.surface, loop_[i]);
    int k = 0;
    while (at_.surface.opposite_halfedge_handle(half_edge_of(at_.surface, outside, k)) != loop_[i])
      ++k;
    return surface.opposite_halfedge_handle(
        half_edge_of(surface, triangle_numbers_.at(outside), k));
  }

 private:
  void number(std::uint32_t vertex) {
    if (numbers_.emplace(vertex, vertices_.size()).second) vertices_.push_back(vertex);
  }

  void add_star(std::uint32_t vertex) {
    for (const std::uint32_t triangle : at_.stars.at(vertex)) {
      if (!triangle_numbers_.emplace(triangle, triangles_.size()).second) continue;
      triangles_.push_back(triangle);
      for (int k = 0; k < 3; ++k) number(at_.mesh.triangles[triangle][k]);
    }
  }

  const AdjacentMesh& at_;
  const BoundaryLoop& loop_;
  glm::dvec3 origin_m_{0};
  std::vector<std::uint32_t> vertices_, triangles_;  // numbers in the mesh
  std::unordered_map<std::uint32_t, std::uint32_t> numbers_, triangle_numbers_;
};

Faces triangulate(SurfaceMesh& mesh, SurfaceMesh::HalfedgeHandle hole) {
  Faces faces;
  const auto points = CGAL::parameters::vertex_point_map(SurfacePoints<Kernel>{&mesh});
#if CGAL_VERSION_NR < 1050600000
  pmp::triangulate_hole(mesh, hole, std::back_inserter(faces), points);
#else
  pmp::triangulate_hole(mesh, hole, points.face_output_iterator(std::back_inserter(faces)));
#endif
  return faces;
}

// Returns true if all points are near the boundary, whose vertices come first; false for NaN.
bool are_near(const SurfaceMesh& mesh, std::uint32_t boundary, const Vertices& points) {
  const std::span at_m(mesh.points(), boundary);
  glm::dvec3 middle(0);
  for (const glm::dvec3& p_m : at_m) middle += p_m / double(boundary);
  double reach_m = 0;
  for (const glm::dvec3& p_m : at_m) reach_m = std::max(reach_m, glm::distance(p_m, middle));
  return std::ranges::all_of(points, [&](auto vertex) {
    return glm::distance(mesh.point(vertex), middle) <= 3 * reach_m;
  });
}

// Moves the points to a thin plate that continues the slope at the boundary. Its stiffness is
// computed from the current triangles: in the first run those of a nearly flat patch, in the second
// those of the plate itself, which reduces the deviation from a ball by three tenths. Further runs
// change little.
bool fair(SurfaceMesh& mesh, const Vertices& points, std::uint32_t boundary) {
  const auto try_once = [&] {
    return pmp::fair(mesh, points,
                     CGAL::parameters::vertex_point_map(SurfacePoints<Kernel>{&mesh})) &&
           are_near(mesh, boundary, points);
  };
  if (!try_once()) return false;
  std::vector<glm::dvec3> once;
  for (const auto vertex : points) once.push_back(mesh.point(vertex));
  if (try_once()) return true;
  for (std::size_t i = 0; i < points.size(); ++i) mesh.point(points[i]) = once[i];
  return true;
}

HolePatch patch_of(const SurfaceMesh& mesh, const Faces& faces, const Surroundings& around,
                   std::uint32_t boundary) {
  HolePatch patch;
  const std::span at_m(mesh.points(), mesh.n_vertices());
  for (const glm::dvec3& p_m : at_m.subspan(around.vertices()))
    patch.points_m.push_back(around.origin_m() + p_m);
  for (const auto face : faces) {
    glm::uvec3 t;
    int k = 0;
    for (const auto vertex : mesh.fv_range(face)) {
      const auto number = static_cast<std::uint32_t>(vertex.idx());
      t[k++] = number < boundary ? number : boundary + (number - around.vertices());
    }
    patch.triangles.push_back(t);
  }
  return patch;
}

}  // namespace

std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings(const TriangleMesh& mesh,
                                                               std::uint32_t first) {
  const auto corners = [&](std::uint32_t t) {
    const glm::uvec3& v = mesh.triangles[t];
    return Corners{mesh.vertices_m[v.x], mesh.vertices_m[v.y], mesh.vertices_m[v.z]};
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  const auto look = [&](const Box& last, const Box& any) {
    if (any.triangle >= last.triangle) return;
    if (do_cross(corners(any.triangle), corners(last.triangle)))
      found.emplace_back(any.triangle, last.triangle);
  };
  const auto triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<Box> last, some;
  for (std::uint32_t t = first; t < triangles; ++t) last.emplace_back(corners(t), t);
  constexpr std::uint32_t at_once = 1'000'000;  // limits memory
  for (std::uint32_t begin = 0; begin < triangles && !last.empty(); begin += at_once) {
    some.clear();
    for (std::uint32_t t = begin; t < std::min(triangles, begin + at_once); ++t)
      some.emplace_back(corners(t), t);
    CGAL::box_intersection_d(last.begin(), last.end(), some.begin(), some.end(), look);
  }
  std::ranges::sort(found);
  return found;
}

std::optional<HolePatch> patch_hole(const AdjacentMesh& at, const BoundaryLoop& loop,
                                    PatchShape shape) {
  const Surroundings around(at, loop);
  SurfaceMesh mesh = around.surface();
  Faces faces = triangulate(mesh, around.local(mesh, 0));
  if (faces.empty()) return std::nullopt;
  Faces more;
  Vertices points;
  pmp::refine(mesh, faces, std::back_inserter(more), std::back_inserter(points),
              CGAL::parameters::vertex_point_map(SurfacePoints<Kernel>{&mesh}));
  faces.insert(faces.end(), more.begin(), more.end());
  const auto boundary = static_cast<std::uint32_t>(loop.size());
  if (shape == PatchShape::Smooth && !points.empty()) {
    if (!fair(mesh, points, boundary)) return std::nullopt;
  }
  return patch_of(mesh, faces, around, boundary);
}

}  // namespace groundray
