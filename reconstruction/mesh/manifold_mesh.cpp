#include "reconstruction/mesh/manifold_mesh.h"

#include <algorithm>
#include <array>
#include <utility>

namespace groundray {
namespace {

bool is_degenerate(const glm::uvec3& t) { return t.x == t.y || t.y == t.z || t.z == t.x; }

// Rotates the vertices so that the smallest comes first: equal for triangles that differ only in
// their first corner.
std::array<std::uint32_t, 3> rotated(const glm::uvec3& t) {
  if (t.x <= t.y && t.x <= t.z) return {t.x, t.y, t.z};
  if (t.y <= t.z) return {t.y, t.z, t.x};
  return {t.z, t.x, t.y};
}

void find_dropped(std::span<const glm::uvec3> triangles, std::size_t vertices, EdgePairs& pairs) {
  pairs.is_dropped.assign(triangles.size(), false);
  const Buckets by_least = sorted_in(
      vertices, triangles.size(), [&](std::uint32_t i) { return rotated(triangles[i]).front(); });
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> alike;
  for (std::size_t bucket = 0; bucket < vertices; ++bucket) {
    alike.clear();
    for (const std::uint32_t i : by_least.at(bucket)) alike.emplace_back(rotated(triangles[i]), i);
    std::ranges::sort(alike);
    for (std::size_t k = 0; k < alike.size(); ++k) {
      const auto& [corners, triangle] = alike[k];
      pairs.is_dropped[triangle] =
          is_degenerate(triangles[triangle]) || (k > 0 && alike[k - 1].first == corners);
    }
  }
  pairs.dropped =
      static_cast<std::size_t>(std::count(pairs.is_dropped.begin(), pairs.is_dropped.end(), true));
}

// Pairs the half-edges that share both ends.
void pair_alike(std::span<const glm::uvec3> triangles, std::span<const HalfEdge> alike,
                EdgePairs& pairs) {
  if (alike.size() == 1) return;
  if (alike.size() == 2 && corner_of(triangles, alike[0]) != corner_of(triangles, alike[1])) {
    pairs.twins[alike[0]] = alike[1];
    pairs.twins[alike[1]] = alike[0];
    return;
  }
  ++pairs.tangled_edges;
  for (const HalfEdge h : alike) pairs.is_tangled[h] = true;
}

}  // namespace

EdgePairs pair_edges(std::span<const glm::uvec3> triangles, std::size_t vertices) {
  EdgePairs pairs;
  const std::size_t half_edges = 3 * triangles.size();
  pairs.twins.assign(half_edges, none);
  pairs.is_tangled.assign(half_edges, false);
  find_dropped(triangles, vertices, pairs);
  const auto ends = [&](HalfEdge h) {
    return std::minmax({corner_of(triangles, h), corner_of(triangles, next_of(h))});
  };
  const Buckets by_lesser = sorted_in(vertices, half_edges, [&](HalfEdge h) {
    return pairs.is_dropped[h / 3] ? none : ends(h).first;
  });
  std::vector<std::pair<std::uint32_t, HalfEdge>> here;  // larger end first
  std::vector<HalfEdge> alike;
  for (std::size_t bucket = 0; bucket < vertices; ++bucket) {
    here.clear();
    for (const HalfEdge h : by_lesser.at(bucket)) here.emplace_back(ends(h).second, h);
    std::ranges::sort(here);
    for (std::size_t k = 0; k < here.size();) {
      alike.clear();
      const std::uint32_t greater = here[k].first;
      for (; k < here.size() && here[k].first == greater; ++k) alike.push_back(here[k].second);
      pair_alike(triangles, alike, pairs);
    }
  }
  return pairs;
}

HalfEdge next_border(const EdgePairs& pairs, HalfEdge border) {
  HalfEdge h = before(border);
  while (pairs.twins[h] != none) h = before(pairs.twins[h]);
  return h;
}

std::vector<std::uint32_t> part_fans(std::vector<glm::uvec3>& triangles, std::size_t vertices,
                                     const EdgePairs& pairs) {
  std::vector<std::uint32_t> added;
  std::vector<bool> is_taken(vertices, false), is_seen(3 * triangles.size(), false);
  std::uint32_t vertex = none;
  const auto take = [&](HalfEdge corner) {
    is_seen[corner] = true;
    triangles[corner / 3][static_cast<int>(corner % 3)] = vertex;
  };
  for (HalfEdge corner = 0; corner < is_seen.size(); ++corner) {
    if (pairs.is_dropped[corner / 3] || is_seen[corner]) continue;
    vertex = corner_of(triangles, corner);
    if (is_taken[vertex]) {
      added.push_back(vertex);
      vertex = static_cast<std::uint32_t>(vertices + added.size() - 1);
    } else {
      is_taken[vertex] = true;
    }
    for (HalfEdge h = corner; h != none && !is_seen[h]; h = pairs.twins[before(h)]) take(h);
    for (HalfEdge h = pairs.twins[corner]; h != none && !is_seen[next_of(h)];) {
      take(next_of(h));
      h = pairs.twins[next_of(h)];
    }
  }
  return added;
}

std::size_t drop_conflicts(std::vector<glm::uvec3>& triangles, std::size_t vertices) {
  const Buckets by_begin = sorted_in(vertices, 3 * triangles.size(),
                                     [&](HalfEdge h) { return corner_of(triangles, h); });
  std::vector<bool> is_out(triangles.size());
  const auto runs_as_an_earlier = [&](HalfEdge h) {
    const std::uint32_t end = corner_of(triangles, next_of(h));
    const auto same = by_begin.at(corner_of(triangles, h));
    return std::ranges::any_of(same, [&](HalfEdge other) {
      return other / 3 < h / 3 && !is_out[other / 3] && corner_of(triangles, next_of(other)) == end;
    });
  };
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    is_out[i] = is_degenerate(triangles[i]) || runs_as_an_earlier(3 * i) ||
                runs_as_an_earlier(3 * i + 1) || runs_as_an_earlier(3 * i + 2);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!is_out[i]) triangles[kept++] = triangles[i];
  }
  const std::size_t dropped = triangles.size() - kept;
  triangles.resize(kept);
  return dropped;
}

void check_columns(const MeasuredMesh& mesh, Violations& broken) {
  const std::size_t vertices = mesh.shape.vertices_m.size();
  const auto check = [&](const char* name, std::size_t count) {
    broken.unless(count == 0 || count == vertices,
                  "{} has {} values for {} vertices: it must have one per vertex or none", name,
                  count, vertices);
  };
  check("sd_m", mesh.sd_m.size());
  check("labels", mesh.labels.size());
  check("confidence", mesh.confidence.size());
}

ManifoldMesh cut_to_manifold(const TriangleMesh& mesh) {
  const std::size_t vertices = mesh.vertices_m.size();
  const EdgePairs pairs = pair_edges(mesh.triangles, vertices);
  std::vector<glm::uvec3> triangles = mesh.triangles;
  const std::vector<std::uint32_t> added = part_fans(triangles, vertices, pairs);
  ManifoldMesh out{
      .tangled_edges = pairs.tangled_edges, .dropped = pairs.dropped, .copies = added.size()};
  std::vector<std::uint32_t> numbers(vertices + added.size(), none);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (pairs.is_dropped[i]) continue;
    out.shape.triangles.push_back(triangles[i]);
    for (int k = 0; k < 3; ++k) numbers[triangles[i][k]] = 0;  // mark as used
  }
  for (std::uint32_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] == none) continue;
    numbers[i] = static_cast<std::uint32_t>(out.sources.size());
    out.sources.push_back(i < vertices ? i : added[i - vertices]);
    out.shape.vertices_m.push_back(mesh.vertices_m[out.sources.back()]);
  }
  for (glm::uvec3& t : out.shape.triangles) t = {numbers[t.x], numbers[t.y], numbers[t.z]};
  out.pairs = pair_edges(out.shape.triangles, out.shape.vertices_m.size());
  return out;
}

}  // namespace groundray
