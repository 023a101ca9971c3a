// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
#include "reconstruction/simplify/lindstrom_turk.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/mesh_check.h"
#include "core/model.h"
#include "reconstruction/half_edge_mesh.h"
#include "reconstruction/manifold_mesh.h"

namespace groundray {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

glm::dvec3 to_glm(const Point& p) { return {p.x(), p.y(), p.z()}; }

// Whether a triangle is counter-clockwise from above, and by more than what moving it to its place
// in the world rounds away.
bool lies_flat(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = b - a, ac = c - a, bc = c - b;
  const double longest2 = std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)});
  return ab.x * ac.y - ab.y * ac.x > 1e-6 * longest2;
}

bool is_height_field(const TriangleMesh& mesh) {
  return std::ranges::all_of(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], ab = mesh.vertices_m[t.y] - a,
                     ac = mesh.vertices_m[t.z] - a;
    return ab.x * ac.y - ab.y * ac.x > 0;
  });
}

// Refuses collapses that turn a triangle over or go far astray.
class TurnFilter {
 public:
  explicit TurnFilter(bool is_height_field) : is_height_field_(is_height_field) {}

  // Place is std::optional or boost::optional of Point, as CGAL's version has it.
  template <typename Profile, typename Place>
  Place operator()(const Profile& profile, Place place) const {
    place = normals_(profile, place);
    if (!place || !is_near(profile, to_glm(*place))) return {};
    if (is_height_field_ && !stays_flat(profile, to_glm(*place))) return {};
    return place;
  }

 private:
  // Planes that are nearly parallel meet anywhere.
  template <typename Profile>
  static bool is_near(const Profile& profile, const glm::dvec3& place) {
    const glm::dvec3 middle = 0.5 * (to_glm(profile.p0()) + to_glm(profile.p1()));
    double reach2 = 0;
    for (const auto& vertex : profile.link()) {
      const glm::dvec3 to = to_glm(get(profile.vertex_point_map(), vertex)) - middle;
      reach2 = std::max(reach2, glm::dot(to, to));
    }
    const glm::dvec3 moved = place - middle;
    return glm::dot(moved, moved) <= 4 * reach2;  // NaN is not
  }

  template <typename Profile>
  static bool stays_flat(const Profile& profile, const glm::dvec3& place) {
    const auto& all = profile.triangles();
    const auto gone = (profile.left_face_exists() ? 1 : 0) + (profile.right_face_exists() ? 1 : 0);
    return std::all_of(all.begin() + gone, all.end(), [&](const auto& t) {
      const auto& places = profile.vertex_point_map();  // the second vertex is the one that moves
      return lies_flat(to_glm(get(places, t.v0)), place, to_glm(get(places, t.v2)));
    });
  }

  sms::Bounded_normal_change_filter<> normals_;
  bool is_height_field_;
};

class EnoughTriangles {
 public:
  EnoughTriangles(const Mesh& mesh, std::size_t triangles) : mesh_(mesh), triangles_(triangles) {}

  template <typename Cost, typename Profile, typename Count>
  bool operator()(const Cost&, const Profile&, Count, Count) const {
    return mesh_.number_of_faces() <= triangles_;
  }

 private:
  const Mesh& mesh_;
  std::size_t triangles_;
};

// Vertices that went into others, as links from each to the one that took it in.
struct Merges {
  std::vector<std::uint32_t> into;

  std::uint32_t last(std::uint32_t vertex) {
    while (into[vertex] != vertex) vertex = into[vertex] = into[into[vertex]];
    return vertex;
  }
};

// Keeps account of collapses and reports progress.
class Account {
 public:
  Account(Merges& merges, const Mesh& mesh, std::size_t triangles, const Work& work)
      : merges_(&merges), mesh_(&mesh), work_(&work) {
    begin_ = static_cast<double>(mesh.number_of_faces());
    end_ = static_cast<double>(triangles);
  }

  // NOLINTBEGIN(readability-identifier-naming): CGAL calls these.
  void OnStarted(Mesh&) {}
  void OnFinished(Mesh&) {}
  template <typename Profile>
  void OnStopConditionReached(const Profile&) {}
  template <typename Profile>
  void OnNonCollapsable(const Profile&) {}
  template <typename Profile, typename Place>
  void OnCollapsing(const Profile&, const Place&) {}

  template <typename Profile, typename Cost>
  void OnCollected(const Profile&, const Cost&) {
    constexpr double share = 0.25;  // of the time, for the first look at all edges
    tell(share * static_cast<double>(++seen_) / static_cast<double>(mesh_->number_of_edges()));
  }

  template <typename Profile, typename Cost, typename Count>
  void OnSelected(const Profile&, const Cost&, Count, Count) {
    ++seen_;
    const double gone = begin_ - static_cast<double>(mesh_->number_of_faces());
    tell(0.25 + 0.75 * gone / (begin_ - end_));
  }

  template <typename Profile>
  void OnCollapsed(const Profile& profile, Mesh::Vertex_index kept) {
    const auto gone = profile.v0() == kept ? profile.v1() : profile.v0();
    merges_->into[gone] = kept;
  }
  // NOLINTEND(readability-identifier-naming)

 private:
  void tell(double share) const {
    if (seen_ % 4096 == 0 && work_->progress) work_->progress(std::min(share, 1.0));
  }

  Merges* merges_;  // CGAL copies visitors
  const Mesh* mesh_;
  const Work* work_;
  std::size_t seen_ = 0;
  double begin_ = 0, end_ = 0;
};

// The middle, with few digits, so that differences from it are exact for the most part.
glm::dvec3 origin_amid(const TriangleMesh& mesh) {
  const ModelBounds bounds = bounds_of(mesh);
  return glm::round(0.5 * (bounds.low_m + bounds.high_m));
}

Mesh mesh_of(const ManifoldMesh& manifold, const glm::dvec3& origin_m) {
  std::vector<glm::dvec3> points_m = manifold.shape.vertices_m;
  for (glm::dvec3& p : points_m) p -= origin_m;
  return half_edge_mesh<Mesh>(points_m, manifold.shape.triangles, manifold.pairs,
                              [&](HalfEdge h) { return next_border(manifold.pairs, h); })
      .mesh;
}

// Numbers what is left of `mesh` anew.
void take_triangles(const Mesh& mesh, std::vector<std::uint32_t>& numbers, TriangleMesh& out) {
  for (const auto vertex : mesh.vertices()) {
    numbers[vertex] = static_cast<std::uint32_t>(out.vertices_m.size());
    out.vertices_m.push_back(to_glm(mesh.point(vertex)));
  }
  for (const auto face : mesh.faces()) {
    glm::uvec3 t;
    int k = 0;
    for (const auto vertex : vertices_around_face(mesh.halfedge(face), mesh))
      t[k++] = numbers[vertex];
    out.triangles.push_back(t);
  }
}

ReducedMesh result_of(const Mesh& mesh, const ManifoldMesh& manifold, Merges& merges,
                      const TriangleMesh& original, const glm::dvec3& origin_m) {
  ReducedMesh out;
  std::vector<std::uint32_t> numbers(manifold.sources.size(), none);
  take_triangles(mesh, numbers, out.mesh);
  const std::size_t vertices = out.mesh.vertices_m.size();
  for (glm::dvec3& p : out.mesh.vertices_m) p += origin_m;
  out.sources.resize(vertices);
  out.became.assign(original.vertices_m.size(), none);
  std::vector<double> nearest_m(vertices, std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> taken(vertices, 0);
  for (std::uint32_t i = 0; i < manifold.sources.size(); ++i) {
    const std::uint32_t source = manifold.sources[i], to = numbers[merges.last(i)];
    if (out.became[source] == none) out.became[source] = to;
    ++taken[to];
    const double apart_m = glm::distance(original.vertices_m[source], out.mesh.vertices_m[to]);
    if (apart_m < nearest_m[to]) {
      nearest_m[to] = apart_m;
      out.sources[to] = source;
    }
  }
  for (std::size_t i = 0; i < vertices; ++i) {
    if (taken[i] == 1) out.mesh.vertices_m[i] = original.vertices_m[out.sources[i]];
  }
  return out;
}

void check_memory(const TriangleMesh& mesh, const Work& work) {
  constexpr std::size_t bytes_each = 500;  // triangle, measured
  if (mesh.triangles.size() > work.most_bytes / bytes_each) {
    throw Error(
        "reducing a mesh: {} triangles take about {} MB, which must be at most {} MB; allow more "
        "memory or cut the mesh in parts",
        mesh.triangles.size(), mesh.triangles.size() * bytes_each / 1'000'000,
        work.most_bytes / 1'000'000);
  }
}

}  // namespace

ReducedMesh reduce(const TriangleMesh& mesh, std::size_t triangles, const Work& work) {
  check_mesh(mesh, "mesh to reduce", EmptyMesh::Refuse);
  if (triangles == 0) throw Error("reducing a mesh: triangles = 0 must be at least 1");
  check_memory(mesh, work);
  const ManifoldMesh manifold = cut_to_manifold(mesh);
  const bool is_flat = is_height_field(manifold.shape);
  const glm::dvec3 origin_m = origin_amid(mesh);
  Mesh half_edges = mesh_of(manifold, origin_m);
  Merges merges;
  merges.into.resize(manifold.sources.size());
  std::iota(merges.into.begin(), merges.into.end(), 0u);
  if (half_edges.number_of_faces() > triangles) {
    sms::edge_collapse(half_edges, EnoughTriangles(half_edges, triangles),
                       CGAL::parameters::get_cost(sms::LindstromTurk_cost<Mesh>())
                           .get_placement(sms::LindstromTurk_placement<Mesh>())
                           .filter(TurnFilter(is_flat))
                           .visitor(Account(merges, half_edges, triangles, work)));
  }
  ReducedMesh out = result_of(half_edges, manifold, merges, mesh, origin_m);
  out.tangled_edges = manifold.tangled_edges;
  out.dropped = manifold.dropped;
  out.is_height_field = is_flat;
  if (work.progress) work.progress(1);
  return out;
}

}  // namespace groundray
