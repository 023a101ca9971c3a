// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
#include "reconstruction/mesh/holes/hole_patch.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/fair.h>
#include <CGAL/Polygon_mesh_processing/refine.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <unordered_map>

#include "reconstruction/mesh/holes/half_edge_mesh.h"

namespace groundray {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Mesh = CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3>;
using Faces = std::vector<Mesh::Face_index>;
using Vertices = std::vector<Mesh::Vertex_index>;

// Triangles around a hole. The vertices of the boundary come first.
class Surroundings {
 public:
  Surroundings(const RimmedMesh& at, std::span<const HalfEdge> chain) : at_(at), rim_(chain) {
    for (const HalfEdge h : chain) number(corner_of(at.mesh.triangles, next_of(h)));
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

  HalfEdgeMesh<Mesh> half_edges() const {
    std::vector<glm::dvec3> points_m;
    for (const std::uint32_t vertex : vertices_)
      points_m.push_back(at_.mesh.vertices_m[vertex] - origin_m_);
    std::vector<glm::uvec3> triangles;
    EdgePairs pairs;
    for (const std::uint32_t t : triangles_) {
      const glm::uvec3& corners = at_.mesh.triangles[t];
      triangles.emplace_back(numbers_.at(corners.x), numbers_.at(corners.y),
                             numbers_.at(corners.z));
      for (const HalfEdge h : {3 * t, 3 * t + 1, 3 * t + 2})
        pairs.twins.push_back(local(at_.pairs.twins[h]));
    }
    return half_edge_mesh<Mesh>(points_m, triangles, pairs, [&](HalfEdge h) {
      const HalfEdge global = 3 * triangles_[h / 3] + h % 3;
      const bool is_at_rim = numbers_.at(corner_of(at_.mesh.triangles, global)) < rim_.size();
      return is_at_rim ? local(at_.rims.next[global]) : next_border(pairs, h);
    });
  }

  // Returns the local number of a half-edge of the mesh; `none` outside the surroundings.
  HalfEdge local(HalfEdge h) const {
    if (h == none) return none;
    const auto found = triangle_numbers_.find(h / 3);
    return found == triangle_numbers_.end() ? none : 3 * found->second + h % 3;
  }

 private:
  void number(std::uint32_t vertex) {
    if (numbers_.emplace(vertex, vertices_.size()).second) vertices_.push_back(vertex);
  }

  void add_star(std::uint32_t vertex) {
    for (const HalfEdge h : at_.stars.at(vertex)) {
      if (!triangle_numbers_.emplace(h / 3, triangles_.size()).second) continue;
      triangles_.push_back(h / 3);
      for (const HalfEdge to : {next_of(h), before(h)}) number(corner_of(at_.mesh.triangles, to));
    }
  }

  const RimmedMesh& at_;
  std::span<const HalfEdge> rim_;
  glm::dvec3 origin_m_{0};
  std::vector<std::uint32_t> vertices_, triangles_;  // numbers in the mesh
  std::unordered_map<std::uint32_t, std::uint32_t> numbers_, triangle_numbers_;
};

Faces triangulate(Mesh& mesh, Mesh::Halfedge_index hole) {
  Faces faces;
#if CGAL_VERSION_NR < 1050600000
  pmp::triangulate_hole(mesh, hole, std::back_inserter(faces));
#else
  pmp::triangulate_hole(mesh, hole,
                        CGAL::parameters::face_output_iterator(std::back_inserter(faces)));
#endif
  return faces;
}

// Returns true if all points are near the boundary, whose vertices come first; false for NaN.
bool are_near(const Mesh& mesh, std::uint32_t rim, const Vertices& points) {
  const auto position = [&](auto vertex) {
    const auto& p = mesh.point(vertex);
    return glm::dvec3(p.x(), p.y(), p.z());
  };
  glm::dvec3 middle(0);
  for (std::uint32_t i = 0; i < rim; ++i) middle += position(Mesh::Vertex_index(i)) / double(rim);
  double reach_m = 0;
  for (std::uint32_t i = 0; i < rim; ++i)
    reach_m = std::max(reach_m, glm::distance(position(Mesh::Vertex_index(i)), middle));
  return std::ranges::all_of(
      points, [&](auto vertex) { return glm::distance(position(vertex), middle) <= 3 * reach_m; });
}

// Moves the points to a thin plate that continues the slope at the boundary. Its stiffness is
// computed from the current triangles: in the first run those of a nearly flat patch, in the second
// those of the plate itself, which reduces the deviation from a ball by three tenths. Further runs
// change little.
bool fair(Mesh& mesh, const Vertices& points, std::uint32_t rim) {
  const auto try_once = [&] { return pmp::fair(mesh, points) && are_near(mesh, rim, points); };
  if (!try_once()) return false;
  std::vector<Mesh::Point> once;
  for (const auto vertex : points) once.push_back(mesh.point(vertex));
  if (try_once()) return true;
  for (std::size_t i = 0; i < points.size(); ++i) mesh.point(points[i]) = once[i];
  return true;
}

HolePatch patch_of(const Mesh& mesh, const Faces& faces, const Surroundings& around,
                   std::uint32_t rim) {
  HolePatch patch;
  for (std::uint32_t i = around.vertices(); i < mesh.number_of_vertices(); ++i) {
    const auto& p = mesh.point(Mesh::Vertex_index(i));
    patch.points_m.push_back(around.origin_m() + glm::dvec3(p.x(), p.y(), p.z()));
  }
  for (const auto face : faces) {
    glm::uvec3 t;
    int k = 0;
    for (const auto vertex : vertices_around_face(mesh.halfedge(face), mesh)) {
      const std::uint32_t number = vertex;
      t[k++] = number < rim ? number : rim + (number - around.vertices());
    }
    patch.triangles.push_back(t);
  }
  return patch;
}

}  // namespace

std::optional<HolePatch> patch_hole(const RimmedMesh& at, std::span<const HalfEdge> chain,
                                    PatchShape shape) {
  const Surroundings around(at, chain);
  HalfEdgeMesh<Mesh> half_edges = around.half_edges();
  Mesh& mesh = half_edges.mesh;
  const auto hole = mesh.opposite(half_edges.half_edges[around.local(chain.front())]);
  Faces faces = triangulate(mesh, hole);
  if (faces.empty()) return std::nullopt;
  Faces more;
  Vertices points;
  pmp::refine(mesh, faces, std::back_inserter(more), std::back_inserter(points));
  faces.insert(faces.end(), more.begin(), more.end());
  const auto rim = static_cast<std::uint32_t>(chain.size());
  if (shape == PatchShape::Smooth && !points.empty()) {
    if (!fair(mesh, points, rim)) return std::nullopt;
  }
  return patch_of(mesh, faces, around, rim);
}

}  // namespace groundray
