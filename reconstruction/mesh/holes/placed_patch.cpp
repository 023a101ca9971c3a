#include "reconstruction/mesh/holes/placed_patch.h"

#include <algorithm>
#include <set>
#include <utility>

namespace groundray {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Returns the edges across the hole between vertices of its boundary: those that two of the patch's
// triangles share.
std::set<Edge> chords_of(const PlacedPatch& placed) {
  const auto edges = static_cast<std::uint32_t>(placed.boundary.size());
  std::set<Edge> once, chords;
  for (const glm::uvec3& t : placed.patch->triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (std::max(a, b) >= edges) continue;
      const Edge edge = std::minmax(placed.boundary[a], placed.boundary[b]);
      if (!once.insert(edge).second) chords.insert(edge);
    }
  }
  return chords;
}

bool has_edge(const TriangleMesh& mesh, const Buckets& stars, const Edge& edge) {
  return std::ranges::any_of(stars.at(edge.first), [&](std::uint32_t triangle) {
    const glm::uvec3& t = mesh.triangles[triangle];
    return t.x == edge.second || t.y == edge.second || t.z == edge.second;
  });
}

// Returns for each of `tried` whether it would put a third triangle at an edge.
std::vector<bool> find_tangled(const TriangleMesh& mesh, const Buckets& stars,
                               std::span<const PlacedPatch> kept,
                               std::span<const PlacedPatch> tried) {
  std::set<Edge> joined;
  for (const PlacedPatch& placed : kept) joined.merge(chords_of(placed));
  std::vector<bool> is_tangled(tried.size());
  for (std::size_t i = 0; i < tried.size(); ++i) {
    std::set<Edge> chords = chords_of(tried[i]);
    is_tangled[i] = std::ranges::any_of(chords, [&](const Edge& chord) {
      return joined.contains(chord) || has_edge(mesh, stars, chord);
    });
    if (!is_tangled[i]) joined.merge(chords);
  }
  return is_tangled;
}

}  // namespace

void append(TriangleMesh& mesh, const PlacedPatch& placed) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  const auto edges = static_cast<std::uint32_t>(placed.boundary.size());
  const auto number = [&](std::uint32_t v) {
    return v < edges ? placed.boundary[v] : first + (v - edges);
  };
  const HolePatch& patch = *placed.patch;
  mesh.vertices_m.insert(mesh.vertices_m.end(), patch.points_m.begin(), patch.points_m.end());
  for (const glm::uvec3& t : patch.triangles)
    mesh.triangles.emplace_back(number(t.x), number(t.y), number(t.z));
}

std::vector<Fit> find_fitting(TriangleMesh& mesh, const Buckets& stars,
                              std::span<const PlacedPatch> kept,
                              std::span<const PlacedPatch> tried) {
  const std::vector<bool> is_tangled = find_tangled(mesh, stars, kept, tried);
  const std::size_t vertices = mesh.vertices_m.size(), triangles = mesh.triangles.size();
  for (const PlacedPatch& placed : kept) append(mesh, placed);
  const auto first = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<std::size_t> owners;  // of each triangle from `first` on
  std::vector<Fit> fits(tried.size());
  for (std::size_t i = 0; i < tried.size(); ++i) {
    fits[i].is_good = !is_tangled[i];
    append(mesh, tried[i]);
    owners.resize(mesh.triangles.size() - first, i);
  }
  std::set<std::pair<std::size_t, std::size_t>> conflicts;  // a patch, and an earlier one or itself
  for (const auto& [any, last] : crossings(mesh, first)) {
    Fit& fit = fits[owners[last - first]];
    if (any >= first) {
      conflicts.emplace(owners[last - first], owners[any - first]);
      continue;
    }
    fit.is_good = false;
    if (any < triangles) fit.crossed.push_back(any);
  }
  for (const auto& [later, earlier] : conflicts) {
    if (later == earlier || fits[earlier].is_good) fits[later].is_good = false;
  }
  mesh.vertices_m.resize(vertices);
  mesh.triangles.resize(triangles);
  for (Fit& fit : fits) {
    const auto repeats = std::ranges::unique(fit.crossed);
    fit.crossed.erase(repeats.begin(), repeats.end());
  }
  return fits;
}

}  // namespace groundray
