#include "reconstruction/manifold_mesh.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <utility>

namespace groundray {
namespace {

// Numbers of things, those of each bucket together.
struct Buckets {
  std::vector<std::uint32_t> begins;  // of each bucket, and the end of the last
  std::vector<std::uint32_t> items;
};

// `bucket_of` may say `none`: such a thing is left out.
template <typename BucketOf>
Buckets sorted_in(std::size_t buckets, std::size_t things, const BucketOf& bucket_of) {
  Buckets sorted{std::vector<std::uint32_t>(buckets + 1), {}};
  for (std::uint32_t i = 0; i < things; ++i) {
    if (const std::uint32_t bucket = bucket_of(i); bucket != none) ++sorted.begins[bucket + 1];
  }
  std::partial_sum(sorted.begins.begin(), sorted.begins.end(), sorted.begins.begin());
  sorted.items.resize(sorted.begins.back());
  std::vector<std::uint32_t> ends(sorted.begins.begin(), sorted.begins.end() - 1);
  for (std::uint32_t i = 0; i < things; ++i) {
    if (const std::uint32_t bucket = bucket_of(i); bucket != none) sorted.items[ends[bucket]++] = i;
  }
  return sorted;
}

// The vertices beginning at the least: equal for triangles that differ in where they begin alone.
std::array<std::uint32_t, 3> rotated(const glm::uvec3& t) {
  if (t.x <= t.y && t.x <= t.z) return {t.x, t.y, t.z};
  if (t.y <= t.z) return {t.y, t.z, t.x};
  return {t.z, t.x, t.y};
}

void find_dropped(const TriangleMesh& mesh, EdgePairs& pairs) {
  const auto& triangles = mesh.triangles;
  pairs.is_dropped.assign(triangles.size(), false);
  const Buckets by_least =
      sorted_in(mesh.vertices_m.size(), triangles.size(),
                [&](std::uint32_t i) { return rotated(triangles[i]).front(); });
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> alike;
  for (std::size_t bucket = 0; bucket < mesh.vertices_m.size(); ++bucket) {
    alike.clear();
    for (std::uint32_t k = by_least.begins[bucket]; k < by_least.begins[bucket + 1]; ++k)
      alike.emplace_back(rotated(triangles[by_least.items[k]]), by_least.items[k]);
    std::ranges::sort(alike);
    for (std::size_t k = 0; k < alike.size(); ++k) {
      const auto& [corners, triangle] = alike[k];
      pairs.is_dropped[triangle] = corners[0] == corners[1] || corners[1] == corners[2] ||
                                   corners[2] == corners[0] ||
                                   (k > 0 && alike[k - 1].first == corners);
    }
  }
  pairs.dropped =
      static_cast<std::size_t>(std::count(pairs.is_dropped.begin(), pairs.is_dropped.end(), true));
}

// Pairs the half-edges that share both their ends.
void pair_alike(const TriangleMesh& mesh, std::span<const HalfEdge> alike, EdgePairs& pairs) {
  if (alike.size() == 1) return;
  if (alike.size() == 2 && corner_of(mesh, alike[0]) != corner_of(mesh, alike[1])) {
    pairs.twins[alike[0]] = alike[1];
    pairs.twins[alike[1]] = alike[0];
    return;
  }
  ++pairs.tangled_edges;
  for (const HalfEdge h : alike) pairs.is_tangled[h] = true;
}

}  // namespace

EdgePairs pair_edges(const TriangleMesh& mesh) {
  EdgePairs pairs;
  const std::size_t half_edges = 3 * mesh.triangles.size();
  pairs.twins.assign(half_edges, none);
  pairs.is_tangled.assign(half_edges, false);
  find_dropped(mesh, pairs);
  const Buckets by_lesser = sorted_in(mesh.vertices_m.size(), half_edges, [&](HalfEdge h) {
    return pairs.is_dropped[h / 3] ? none
                                   : std::min(corner_of(mesh, h), corner_of(mesh, next_of(h)));
  });
  std::vector<std::pair<std::uint32_t, HalfEdge>> here;  // greater end first
  std::vector<HalfEdge> alike;
  for (std::size_t bucket = 0; bucket < mesh.vertices_m.size(); ++bucket) {
    here.clear();
    for (std::uint32_t k = by_lesser.begins[bucket]; k < by_lesser.begins[bucket + 1]; ++k) {
      const HalfEdge h = by_lesser.items[k];
      here.emplace_back(std::max(corner_of(mesh, h), corner_of(mesh, next_of(h))), h);
    }
    std::ranges::sort(here);
    for (std::size_t k = 0; k < here.size();) {
      alike.clear();
      const std::uint32_t greater = here[k].first;
      for (; k < here.size() && here[k].first == greater; ++k) alike.push_back(here[k].second);
      pair_alike(mesh, alike, pairs);
    }
  }
  return pairs;
}

HalfEdge next_border(const EdgePairs& pairs, HalfEdge border) {
  HalfEdge h = before(border);
  while (pairs.twins[h] != none) h = before(pairs.twins[h]);
  return h;
}

namespace {

// Gives each fan of triangles round a vertex a vertex of its own; the first fan keeps the vertex.
class FanSplitter {
 public:
  FanSplitter(const TriangleMesh& mesh, const EdgePairs& pairs)
      : mesh_(mesh), pairs_(pairs), fans_(3 * mesh.triangles.size(), none) {}

  ManifoldMesh split() {
    std::vector<bool> is_used(mesh_.vertices_m.size(), false);
    std::vector<std::uint32_t> extra;  // sources of copies
    for (HalfEdge h = 0; h < fans_.size(); ++h) {
      if (pairs_.is_dropped[h / 3] || fans_[h] != none) continue;
      const std::uint32_t vertex = corner_of(mesh_, h);
      if (!is_used[vertex]) {
        is_used[vertex] = true;
        mark(h, vertex);
      } else {
        mark(h, static_cast<std::uint32_t>(mesh_.vertices_m.size() + extra.size()));
        extra.push_back(vertex);
      }
    }
    return numbered(is_used, extra);
  }

 private:
  // Says for all corners of the fan at the beginning of `h` which vertex they get.
  void mark(HalfEdge h, std::uint32_t vertex) {
    for (HalfEdge to = h; to != none && fans_[to] == none;) {
      fans_[to] = vertex;
      to = pairs_.twins[before(to)];
    }
    for (HalfEdge to = pairs_.twins[h]; to != none && fans_[next_of(to)] == none;) {
      fans_[next_of(to)] = vertex;
      to = pairs_.twins[next_of(to)];
    }
  }

  ManifoldMesh numbered(const std::vector<bool>& is_used,
                        const std::vector<std::uint32_t>& extra) const {
    ManifoldMesh out;
    std::vector<std::uint32_t> numbers(is_used.size() + extra.size(), none);
    const auto add = [&](std::size_t vertex, std::uint32_t source) {
      numbers[vertex] = static_cast<std::uint32_t>(out.sources.size());
      out.sources.push_back(source);
      out.shape.vertices_m.push_back(mesh_.vertices_m[source]);
    };
    for (std::uint32_t i = 0; i < is_used.size(); ++i) {
      if (is_used[i]) add(i, i);
    }
    for (std::size_t i = 0; i < extra.size(); ++i) add(is_used.size() + i, extra[i]);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (pairs_.is_dropped[t]) continue;
      out.shape.triangles.emplace_back(numbers[fans_[3 * t]], numbers[fans_[3 * t + 1]],
                                       numbers[fans_[3 * t + 2]]);
    }
    out.tangled_edges = pairs_.tangled_edges;
    out.dropped = pairs_.dropped;
    out.copies = extra.size();
    return out;
  }

  const TriangleMesh& mesh_;
  const EdgePairs& pairs_;
  std::vector<std::uint32_t> fans_;  // of each half-edge: the vertex at its beginning
};

}  // namespace

ManifoldMesh cut_to_manifold(const TriangleMesh& mesh) {
  ManifoldMesh out = FanSplitter(mesh, pair_edges(mesh)).split();
  out.pairs = pair_edges(out.shape);
  return out;
}

}  // namespace groundray
