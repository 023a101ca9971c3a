// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
#include "reconstruction/mesh/simplify/lindstrom_turk.h"

#include <CGAL/Simple_cartesian.h>
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
#include "core/geometry/mesh.h"
#include "core/model/model.h"
#include "reconstruction/mesh/manifold_mesh.h"
#include "reconstruction/mesh/simplify/star.h"
#include "reconstruction/mesh/surface_cgal.h"

namespace groundray {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;

bool is_height_field(const TriangleMesh& mesh) {
  return std::ranges::all_of(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], ab = mesh.vertices_m[t.y] - a,
                     ac = mesh.vertices_m[t.z] - a;
    return ab.x * ac.y - ab.y * ac.x > 0;
  });
}

// Returns the centre, rounded to metres so that differences from it are mostly exact.
glm::dvec3 origin_amid(const TriangleMesh& mesh) {
  const ModelBounds bounds = bounds_of(mesh);
  return glm::round(0.5 * (bounds.low_m + bounds.high_m));
}

// Returns the largest absolute coordinate, which has the largest rounding error.
double farthest_m(const TriangleMesh& mesh) {
  const ModelBounds bounds = bounds_of(mesh);
  const glm::dvec3 away = glm::max(glm::abs(bounds.low_m), glm::abs(bounds.high_m));
  return std::max({away.x, away.y, away.z});
}

glm::dvec3 to_glm(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

// Returns true if a triangle is counter-clockwise from above by more than the rounding of its final
// position, `away_m` from the world's origin: half an ulp of each coordinate.
bool lies_flat(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double away_m) {
  const glm::dvec3 ab = b - a, ac = c - a, bc = c - b;
  const double longest2 = std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)});
  const double rounding_m = 8 * std::numeric_limits<double>::epsilon() * away_m;
  return ab.x * ac.y - ab.y * ac.x > std::max(1e-6 * longest2, rounding_m * std::sqrt(longest2));
}

// Collapses of a run, and the number of triangles left.
struct Collapses {
  std::vector<std::uint32_t> into;  // of each vertex: the one that absorbed it, or itself
  std::size_t first = 0, last = 0;  // number of triangles at the beginning and at the end
  std::size_t triangles = 0;
  bool is_flat = false;
  double away_m = 0;
  const RunControl& work;
  double visited = 0, next = 0;  // triangles that CGAL visited, and when to report again

  std::uint32_t survivor(std::uint32_t vertex) {
    while (into[vertex] != vertex) vertex = into[vertex] = into[into[vertex]];
    return vertex;
  }

  void report() {
    if (visited < next) return;
    next = visited + 1e5;
    constexpr double looking = 0.1;  // fraction of progress for first evaluating all edges
    const double all = 15 * static_cast<double>(first);  // 1.5 edges per triangle, 10 at each
    const double share = triangles == first
                             ? looking * std::min(1.0, visited / all)
                             : looking + (1 - looking) * static_cast<double>(first - triangles) /
                                             static_cast<double>(first - last);
    work.report(std::min(share, 1.0));
  }
};

// Stops CGAL at a number of triangles.
struct EnoughCollapses {
  const Collapses* run;
  template <typename Cost, typename Profile>
  bool operator()(const Cost&, const Profile&, std::size_t, std::size_t) const {
    return run->triangles <= run->last;
  }
};

// Rejects positions that turn a triangle by more than a right angle, or make one of a height field
// overhang.
struct KeepsSides {
  const Collapses* run;
  template <typename Profile, typename Place>
  Place operator()(const Profile& profile, const Place& place) const {
    if (!place) return place;
    const auto before = [&](auto vertex) { return profile.surface_mesh().point(vertex); };
    const auto after = [&](auto vertex) {
      return vertex == profile.v0() || vertex == profile.v1() ? to_glm(*place) : before(vertex);
    };
    for (const auto& t : profile.triangles()) {
      const auto vanishes = [&](auto vertex) {
        return vertex == t.v0 || vertex == t.v1 || vertex == t.v2;
      };
      if (vanishes(profile.v0()) && vanishes(profile.v1())) continue;
      const auto area = [&](const auto& at) {
        return glm::cross(at(t.v1) - at(t.v0), at(t.v2) - at(t.v0));
      };
      const bool is_kept = run->is_flat
                               ? lies_flat(after(t.v0), after(t.v1), after(t.v2), run->away_m)
                               : !(glm::dot(area(before), area(after)) < 0);
      if (!is_kept) return Place();
    }
    return place;
  }
};

// Counts triangles, records merges and reports progress.
struct Observer {
  Collapses* run;

  void OnStarted(SurfaceMesh&) const {}
  void OnFinished(SurfaceMesh&) const {}
  template <typename Profile>
  void OnStopConditionReached(const Profile&) const {}
  template <typename Profile, typename Cost>
  void OnCollected(const Profile& profile, const Cost&) const {
    run->visited += static_cast<double>(profile.triangles().size());
    run->report();
  }
  template <typename Profile, typename Cost>
  void OnSelected(const Profile&, const Cost&, std::size_t, std::size_t) const {}
  template <typename Profile, typename Place>
  void OnCollapsing(const Profile& profile, const Place&) const {
    for (const auto vertex : profile.link()) {  // each of its edges is evaluated again
      const double edges = profile.surface_mesh().valence(vertex);
      run->visited += edges * edges;
    }
    run->report();
  }
  template <typename Profile, typename Vertex>
  void OnCollapsed(const Profile& profile, Vertex kept) const {
    run->triangles -= std::size_t{profile.left_face_exists()} + profile.right_face_exists();
    for (const auto end : {profile.v0(), profile.v1()})
      run->into[static_cast<std::size_t>(end.idx())] = static_cast<std::uint32_t>(kept.idx());
  }
  template <typename Profile>
  void OnNonCollapsable(const Profile&) const {}
};

// Collapses edges without length. CGAL would collapse all of them, without asking for the number of
// triangles.
void collapse_zero_edges(SurfaceMesh& surface, Collapses& run) {
  Star star;
  const auto try_onto = [&](SurfaceMesh::HalfedgeHandle along) {
    const std::uint32_t from = number_of(surface.from_vertex_handle(along));
    gather(surface, from, star);
    const auto to =
        static_cast<std::size_t>(std::ranges::find(star.spokes, along) - star.spokes.begin());
    const bool is_along_border = to == 0 || to + 1 == star.spokes.size();
    if ((star.is_open() && !is_along_border) || !may_collapse(star, to)) return false;
    run.triangles -= star.is_open() ? 1 : 2;
    run.into[from] = star.ring[to];
    collapse(surface, star, to);
    return true;
  };
  for (unsigned i = 0; i < surface.n_edges() && run.triangles > run.last; ++i) {
    const auto edge = surface.edge_handle(i);
    const auto h = surface.halfedge_handle(edge, 0), twin = surface.halfedge_handle(edge, 1);
    if (surface.status(edge).deleted() ||
        surface.point(surface.from_vertex_handle(h)) != surface.point(surface.to_vertex_handle(h)))
      continue;
    if (!try_onto(h)) try_onto(twin);
  }
}

void collapse_edges(SurfaceMesh& surface, Collapses& run) {
  sms::edge_collapse(surface, EnoughCollapses{&run},
                     CGAL::parameters::vertex_point_map(SurfacePoints<Kernel>{&surface})
                         .get_cost(sms::LindstromTurk_cost<SurfaceMesh>())
                         .get_placement(sms::LindstromTurk_placement<SurfaceMesh>())
                         .filter(KeepsSides{&run})
                         .visitor(Observer{&run}));
}

ReducedMesh make_reduced_mesh(const SurfaceMesh& surface, const ManifoldMesh& manifold,
                              Collapses& run, const TriangleMesh& original,
                              const glm::dvec3& origin_m) {
  RemainingMesh remaining = remaining_mesh(surface);
  ReducedMesh out{.mesh = std::move(remaining.mesh)};
  const std::size_t vertices = out.mesh.vertices_m.size();
  for (glm::dvec3& p : out.mesh.vertices_m) p += origin_m;
  out.sources.resize(vertices);
  out.became.assign(original.vertices_m.size(), none);
  std::vector<double> nearest_m(vertices, std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> taken(vertices, 0);
  for (std::uint32_t i = 0; i < manifold.sources.size(); ++i) {
    const std::uint32_t source = manifold.sources[i], to = remaining.numbers[run.survivor(i)];
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

void check_triangle_count(const TriangleMesh& mesh, const RunControl& work) {
  if (mesh.triangles.size() >= most_triangles) {
    throw Error("reducing a mesh: {} triangles must be fewer than {}; split the mesh",
                mesh.triangles.size(), most_triangles);
  }
  // Measured: 182 per triangle of a grid, 521 of separate triangles.
  const std::size_t bytes = 120 * mesh.triangles.size() + 140 * mesh.vertices_m.size();
  if (bytes > work.most_bytes) {
    throw Error(
        "reducing a mesh: {} triangles take about {} MB, more than the {} MB allowed; allow more "
        "memory or split the mesh",
        mesh.triangles.size(), bytes / 1'000'000, work.most_bytes / 1'000'000);
  }
}

}  // namespace

ReducedMesh reduce(const TriangleMesh& mesh, std::size_t triangles, const RunControl& work) {
  check_mesh(mesh, "mesh to reduce", EmptyMesh::Refuse);
  if (triangles == 0) throw Error("reducing a mesh: triangles = 0 must be at least 1");
  check_triangle_count(mesh, work);
  ManifoldMesh manifold = cut_to_manifold(mesh);
  const glm::dvec3 origin_m = origin_amid(mesh);
  Collapses run{.into = std::vector<std::uint32_t>(manifold.sources.size()),
                .first = manifold.shape.triangles.size(),
                .last = triangles,
                .triangles = manifold.shape.triangles.size(),
                .is_flat = is_height_field(manifold.shape),
                .away_m = farthest_m(mesh),
                .work = work};
  std::iota(run.into.begin(), run.into.end(), 0u);
  for (glm::dvec3& p : manifold.shape.vertices_m) p -= origin_m;
  SurfaceMesh surface = to_surface(manifold.shape);
  collapse_zero_edges(surface, run);
  if (run.triangles > triangles) collapse_edges(surface, run);
  ReducedMesh out = make_reduced_mesh(surface, manifold, run, mesh, origin_m);
  out.tangled_edges = manifold.tangled_edges;
  out.dropped = manifold.dropped;
  out.is_height_field = run.is_flat;
  work.report(1);
  return out;
}

}  // namespace groundray
