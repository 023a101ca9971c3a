#include "reconstruction/mesh/holes/mesh_boundary.h"

#include <algorithm>
#include <array>
#include <compare>
#include <glm/geometric.hpp>
#include <set>
#include <utility>

#include "reconstruction/mesh/holes/hole_patch.h"

namespace groundray {
namespace {

// Cuts a walk along the boundary, which may pass a vertex several times, into chains that do not.
class ChainCutter {
 public:
  ChainCutter(const TriangleMesh& mesh, MeshBoundary& boundary)
      : mesh_(mesh), boundary_(boundary), places_(mesh.vertices_m.size(), none) {}

  void cut(std::span<const HalfEdge> walk) {
    for (const HalfEdge h : walk) {
      const std::uint32_t vertex = corner_of(mesh_.triangles, next_of(h));
      if (places_[vertex] != none) take_from(places_[vertex]);
      places_[vertex] = static_cast<std::uint32_t>(open_.size());
      open_.push_back(h);
    }
    take_from(0);
  }

 private:
  void take_from(std::size_t place) {
    const std::vector<HalfEdge> chain(open_.begin() + static_cast<std::ptrdiff_t>(place),
                                      open_.end());
    open_.resize(place);
    for (std::size_t i = 0; i < chain.size(); ++i) {
      boundary_.next[chain[i]] = chain[(i + 1) % chain.size()];
      places_[corner_of(mesh_.triangles, next_of(chain[i]))] = none;
    }
    boundary_.chains.push_back(chain);
  }

  const TriangleMesh& mesh_;
  MeshBoundary& boundary_;
  std::vector<std::uint32_t> places_;  // by end vertex: index of a half-edge in `open_`
  std::vector<HalfEdge> open_;
};

std::uint32_t after(std::span<const std::uint32_t> chain, std::size_t i) {
  return chain[(i + 1) % chain.size()];
}

// Edges of a boundary and of an outline that may be joined.
struct Place {
  double sides_m = 0;  // length of the two outer sides of the triangles between them
  std::size_t on_boundary = 0, on_outline = 0;
  friend auto operator<=>(const Place&, const Place&) = default;
};

// Returns the closest candidates, closest first; none if the chains share a vertex.
std::vector<Place> near_places(const TriangleMesh& mesh, std::span<const std::uint32_t> boundary,
                               std::span<const std::uint32_t> outline) {
  constexpr std::ptrdiff_t most = 100;
  const auto apart_m = [&](std::uint32_t a, std::uint32_t b) {
    return glm::distance(mesh.vertices_m[a], mesh.vertices_m[b]);
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    for (std::size_t k = 0; k < outline.size(); ++k) {
      if (boundary[i] == outline[k]) return {};
      const double sides_m =
          apart_m(after(boundary, i), outline[k]) + apart_m(after(outline, k), boundary[i]);
      places.push_back({sides_m, i, k});
    }
  }
  const auto end = places.begin() + std::min(std::ssize(places), most);
  std::ranges::partial_sort(places, end);
  places.erase(end, places.end());
  return places;
}

// Returns the triangles between two edges if they face alike and intersect none at their corners.
std::vector<glm::uvec3> triangles_at(const TriangleMesh& mesh, const VertexStars& stars,
                                     const std::array<std::uint32_t, 4>& corners) {
  const std::uint32_t a = corners[0], b = corners[1], c = corners[2], d = corners[3];
  TriangleMesh beside;
  const auto add = [&](const glm::uvec3& t) {
    const auto begin = static_cast<std::uint32_t>(beside.vertices_m.size());
    for (int k = 0; k < 3; ++k) beside.vertices_m.push_back(mesh.vertices_m[t[k]]);
    beside.triangles.emplace_back(begin, begin + 1, begin + 2);
  };
  std::set<std::uint32_t> taken;
  for (const std::uint32_t corner : corners) {
    for (const HalfEdge h : stars.at(corner)) {
      if (taken.insert(h / 3).second) add(mesh.triangles[h / 3]);
    }
  }
  const auto first = static_cast<std::uint32_t>(beside.triangles.size());
  for (const auto& [one, other] : {std::pair(glm::uvec3(a, b, c), glm::uvec3(a, c, d)),
                                   std::pair(glm::uvec3(a, b, d), glm::uvec3(b, c, d))}) {
    if (!(glm::dot(area_vector_m2(mesh, one), area_vector_m2(mesh, other)) > 0)) continue;
    beside.triangles.resize(first);
    add(one);
    add(other);
    if (crossings(beside, first).empty()) return {one, other};
  }
  return {};
}

}  // namespace

MeshBoundary find_boundary(const TriangleMesh& mesh, const EdgePairs& pairs) {
  MeshBoundary boundary;
  boundary.next.assign(pairs.twins.size(), none);
  ChainCutter cutter(mesh, boundary);
  std::vector<bool> is_seen(pairs.twins.size(), false);
  std::vector<HalfEdge> walk;
  for (HalfEdge first = 0; first < pairs.twins.size(); ++first) {
    if (pairs.twins[first] != none || pairs.is_dropped[first / 3] || is_seen[first]) continue;
    walk.clear();
    for (HalfEdge h = first; !is_seen[h]; h = next_border(pairs, h)) {
      is_seen[h] = true;
      walk.push_back(h);
    }
    cutter.cut(walk);
  }
  return boundary;
}

VertexStars::VertexStars(const TriangleMesh& mesh, const EdgePairs& pairs)
    : half_edges_(sorted_in(mesh.vertices_m.size(), pairs.twins.size(), [&](HalfEdge h) {
        return pairs.is_dropped[h / 3] ? none : corner_of(mesh.triangles, h);
      })) {}

bool VertexStars::has_edge(const TriangleMesh& mesh, std::uint32_t a,
                           std::uint32_t b) const noexcept {
  for (const HalfEdge h : at(a)) {
    if (corner_of(mesh.triangles, next_of(h)) == b || corner_of(mesh.triangles, before(h)) == b)
      return true;
  }
  return false;
}

std::optional<BridgedBoundary> bridge(const TriangleMesh& mesh, const VertexStars& stars,
                                      BridgedBoundary boundary,
                                      std::span<const std::uint32_t> outline) {
  for (const Place& place : near_places(mesh, boundary.vertices, outline)) {
    const std::size_t at = place.on_boundary, to = place.on_outline;
    const std::vector<glm::uvec3> triangles = triangles_at(
        mesh, stars,
        {boundary.vertices[at], after(boundary.vertices, at), outline[to], after(outline, to)});
    if (triangles.empty()) continue;
    boundary.bridges.insert(boundary.bridges.end(), triangles.begin(), triangles.end());
    std::vector<std::uint32_t> round(outline.begin(), outline.end());
    std::ranges::rotate(round,
                        round.begin() + static_cast<std::ptrdiff_t>(to + 1) % std::ssize(round));
    boundary.vertices.insert(boundary.vertices.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                             round.begin(), round.end());
    return boundary;
  }
  return std::nullopt;
}

std::vector<std::uint32_t> number_pieces(const EdgePairs& pairs) {
  std::vector<std::uint32_t> numbers(pairs.is_dropped.size(), none), open;
  std::uint32_t count = 0;
  for (std::uint32_t first = 0; first < numbers.size(); ++first) {
    if (numbers[first] != none || pairs.is_dropped[first]) continue;
    numbers[first] = count;
    open.assign(1, first);
    while (!open.empty()) {
      const HalfEdge h = 3 * open.back();
      open.pop_back();
      for (const HalfEdge twin : {pairs.twins[h], pairs.twins[h + 1], pairs.twins[h + 2]}) {
        if (twin == none || numbers[twin / 3] != none) continue;
        numbers[twin / 3] = count;
        open.push_back(twin / 3);
      }
    }
    ++count;
  }
  return numbers;
}

}  // namespace groundray
