#include "reconstruction/mesh/simplify/lindstrom_turk.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/model/model.h"
#include "reconstruction/mesh/manifold_mesh.h"
#include "reconstruction/mesh/simplify/volume_collapse.h"

namespace groundray {
namespace {

bool is_height_field(const TriangleMesh& mesh) {
  return std::ranges::all_of(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], ab = mesh.vertices_m[t.y] - a,
                     ac = mesh.vertices_m[t.z] - a;
    return ab.x * ac.y - ab.y * ac.x > 0;
  });
}

// Merged vertices, as links from each to the one that absorbed it.
struct Merges {
  std::vector<std::uint32_t> into;

  std::uint32_t last(std::uint32_t vertex) {
    while (into[vertex] != vertex) vertex = into[vertex] = into[into[vertex]];
    return vertex;
  }
};

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

// Renumbers the remainder of `mesh`.
void take_triangles(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m,
                    std::vector<std::uint32_t>& numbers, TriangleMesh& out) {
  for (std::uint32_t v = 0; v < numbers.size(); ++v) {
    if (!mesh.has_vertex(v)) continue;
    numbers[v] = static_cast<std::uint32_t>(out.vertices_m.size());
    out.vertices_m.push_back(places_m[v]);
  }
  for (std::uint32_t i = 0; i < mesh.numbers(); ++i) {
    if (!mesh.has_triangle(i)) continue;
    const glm::uvec3 t = mesh.corners(i);
    out.triangles.emplace_back(numbers[t.x], numbers[t.y], numbers[t.z]);
  }
}

ReducedMesh make_reduced_mesh(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m,
                              const ManifoldMesh& manifold, Merges& merges,
                              const TriangleMesh& original, const glm::dvec3& origin_m) {
  ReducedMesh out;
  std::vector<std::uint32_t> numbers(manifold.sources.size(), none);
  take_triangles(mesh, places_m, numbers, out.mesh);
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

void collapse_edges(std::size_t triangles, bool is_flat, double away_m, const RunControl& work,
                    CollapsibleMesh& mesh, std::vector<glm::dvec3>& places_m, Merges& merges) {
  constexpr double looking = 0.1;  // fraction of progress for first evaluating all edges
  const auto tell = [&](double share) { work.report(share); };
  constexpr std::uint64_t edges_each = 16384;  // edges evaluated per call of progress
  const std::size_t first = mesh.triangles();
  VolumeCollapse collapse(mesh, places_m, {is_flat ? Overhang::Refuse : Overhang::Allow, away_m},
                          [&](double share) { tell(looking * share); });
  for (std::uint64_t next = 0; mesh.triangles() > triangles;) {
    if (collapse.looked_at() >= next) {
      next = collapse.looked_at() + edges_each;
      tell(looking + (1 - looking) * static_cast<double>(first - mesh.triangles()) /
                         static_cast<double>(first - triangles));
    }
    const auto merge = collapse.step();
    if (!merge) break;
    merges.into[merge->gone] = merge->kept;
  }
}

void check_triangle_count(const TriangleMesh& mesh, const RunControl& work) {
  constexpr std::size_t most_triangles = 1'400'000'000;  // limit of 32-bit numbers of half-edges
  if (mesh.triangles.size() >= most_triangles) {
    throw Error("reducing a mesh: {} triangles must be fewer than {}; split the mesh",
                mesh.triangles.size(), most_triangles);
  }
  constexpr std::size_t bytes_each = 500;  // per triangle, measured
  if (mesh.triangles.size() > work.most_bytes / bytes_each) {
    throw Error(
        "reducing a mesh: {} triangles take about {} MB, more than the {} MB allowed; allow more "
        "memory or split the mesh",
        mesh.triangles.size(), mesh.triangles.size() * bytes_each / 1'000'000,
        work.most_bytes / 1'000'000);
  }
}

}  // namespace

ReducedMesh reduce(const TriangleMesh& mesh, std::size_t triangles, const RunControl& work) {
  check_mesh(mesh, "mesh to reduce", EmptyMesh::Refuse);
  if (triangles == 0) throw Error("reducing a mesh: triangles = 0 must be at least 1");
  check_triangle_count(mesh, work);
  const ManifoldMesh manifold = cut_to_manifold(mesh);
  const bool is_flat = is_height_field(manifold.shape);
  const glm::dvec3 origin_m = origin_amid(mesh);
  std::vector<glm::dvec3> places_m = manifold.shape.vertices_m;
  for (glm::dvec3& p : places_m) p -= origin_m;
  CollapsibleMesh rest(manifold);
  Merges merges;
  merges.into.resize(manifold.sources.size());
  std::iota(merges.into.begin(), merges.into.end(), 0u);
  if (rest.triangles() > triangles)
    collapse_edges(triangles, is_flat, farthest_m(mesh), work, rest, places_m, merges);
  ReducedMesh out = make_reduced_mesh(rest, places_m, manifold, merges, mesh, origin_m);
  out.tangled_edges = manifold.tangled_edges;
  out.dropped = manifold.dropped;
  out.is_height_field = is_flat;
  work.report(1);
  return out;
}

}  // namespace groundray
