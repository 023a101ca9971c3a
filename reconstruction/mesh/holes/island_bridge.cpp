#include "reconstruction/mesh/holes/island_bridge.h"

#include <algorithm>
#include <array>
#include <compare>
#include <glm/geometric.hpp>
#include <set>
#include <utility>

#include "reconstruction/mesh/holes/triangle_crossing.h"

namespace groundray {

namespace {

std::uint32_t after(std::span<const std::uint32_t> chain, std::size_t i) {
  return chain[(i + 1) % chain.size()];
}

// Edges of a boundary and of an outline that may be joined.
struct Place {
  double sides_m = 0;  // length of the two outer sides of the triangles between them
  std::size_t on_rim = 0, on_outline = 0;
  friend auto operator<=>(const Place&, const Place&) = default;
};

// Returns the closest candidates, closest first; none if the chains share a vertex.
std::vector<Place> near_places(const TriangleMesh& mesh, std::span<const std::uint32_t> rim,
                               std::span<const std::uint32_t> outline) {
  constexpr std::ptrdiff_t most = 100;
  const auto apart_m = [&](std::uint32_t a, std::uint32_t b) {
    return glm::distance(mesh.vertices_m[a], mesh.vertices_m[b]);
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    for (std::size_t k = 0; k < outline.size(); ++k) {
      if (rim[i] == outline[k]) return {};
      const double sides_m =
          apart_m(after(rim, i), outline[k]) + apart_m(after(outline, k), rim[i]);
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
  const auto normal = [&](const glm::uvec3& t) {
    const glm::dvec3& from = mesh.vertices_m[t.x];
    return glm::cross(mesh.vertices_m[t.y] - from, mesh.vertices_m[t.z] - from);
  };
  const auto first = static_cast<std::uint32_t>(beside.triangles.size());
  for (const auto& [one, other] : {std::pair(glm::uvec3(a, b, c), glm::uvec3(a, c, d)),
                                   std::pair(glm::uvec3(a, b, d), glm::uvec3(b, c, d))}) {
    if (!(glm::dot(normal(one), normal(other)) > 0)) continue;
    beside.triangles.resize(first);
    add(one);
    add(other);
    if (crossings(beside, first).empty()) return {one, other};
  }
  return {};
}

}  // namespace

std::optional<BridgedRim> bridge(const TriangleMesh& mesh, const VertexStars& stars, BridgedRim rim,
                                 std::span<const std::uint32_t> outline) {
  for (const Place& place : near_places(mesh, rim.vertices, outline)) {
    const std::size_t at = place.on_rim, to = place.on_outline;
    const std::vector<glm::uvec3> triangles = triangles_at(
        mesh, stars, {rim.vertices[at], after(rim.vertices, at), outline[to], after(outline, to)});
    if (triangles.empty()) continue;
    rim.bridges.insert(rim.bridges.end(), triangles.begin(), triangles.end());
    std::vector<std::uint32_t> round(outline.begin(), outline.end());
    std::ranges::rotate(round,
                        round.begin() + static_cast<std::ptrdiff_t>(to + 1) % std::ssize(round));
    rim.vertices.insert(rim.vertices.begin() + static_cast<std::ptrdiff_t>(at) + 1, round.begin(),
                        round.end());
    return rim;
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
