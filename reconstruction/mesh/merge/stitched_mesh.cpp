#include "reconstruction/mesh/merge/stitched_mesh.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "reconstruction/mesh/manifold_mesh.h"
#include "reconstruction/mesh/merge/loop_triangulation.h"

namespace groundray {
namespace {

std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

/// Vertices inserted on each edge, from its end with the lower number on.
using OnEdges = std::unordered_map<std::uint64_t, std::vector<std::uint32_t>>;

/// Returns the corners of a triangle and the vertices inserted on its edges, in order.
std::vector<std::uint32_t> loop_of(const glm::uvec3& t, const OnEdges& on_edges) {
  std::vector<std::uint32_t> loop;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t from = t[k], to = t[(k + 1) % 3];
    loop.push_back(from);
    const auto found = on_edges.find(key_of(from, to));
    if (found == on_edges.end()) continue;
    const std::vector<std::uint32_t>& on = found->second;
    if (from < to) {
      loop.insert(loop.end(), on.begin(), on.end());
    } else {
      loop.insert(loop.end(), on.rbegin(), on.rend());
    }
  }
  return loop;
}

void cut(StitchedMesh& stitched, std::size_t triangle, const std::vector<std::uint32_t>& loop) {
  const auto p = [&](std::uint32_t v) { return stitched.vertices[v].p; };
  const glm::uvec3 t = stitched.triangles[triangle];
  std::vector<glm::dvec3> points(loop.size());
  std::ranges::transform(loop, points.begin(), p);
  const glm::dvec3 normal = glm::cross(p(t.y) - p(t.x), p(t.z) - p(t.x));
  const double length = glm::length(normal);
  const LoopTriangles cut = triangulate_loop(points, length > 0 ? normal / length : glm::dvec3(0));
  for (std::size_t i = 0; i < cut.triangles.size(); ++i) {
    const glm::uvec3& c = cut.triangles[i];
    const glm::uvec3 part(loop[c.x], loop[c.y], loop[c.z]);
    if (i == 0) {
      stitched.triangles[triangle] = part;
    } else {
      stitched.triangles.push_back(part);
    }
  }
}

}  // namespace

StitchedVertex between(const StitchedVertex& from, const StitchedVertex& to, double share) {
  StitchedVertex out = share < 0.5 ? from : to;  // label and scan of the nearer end
  const auto portion = static_cast<float>(share);
  out.p = glm::mix(from.p, to.p, share);
  out.sd_m = glm::mix(from.sd_m, to.sd_m, portion);
  out.confidence = glm::mix(from.confidence, to.confidence, portion);
  const glm::vec3 normal = glm::mix(from.normal, to.normal, portion);
  if (glm::length(normal) > 0) out.normal = glm::normalize(normal);
  out.vertex = no_vertex;
  out.is_shared = from.is_shared || to.is_shared;
  return out;
}

TriangleMesh mesh_of(const StitchedMesh& stitched) {
  TriangleMesh mesh{.triangles = stitched.triangles};
  mesh.vertices_m.reserve(stitched.vertices.size());
  for (const StitchedVertex& vertex : stitched.vertices) mesh.vertices_m.push_back(vertex.p);
  return mesh;
}

std::vector<float> sds_of(const StitchedMesh& stitched) {
  std::vector<float> sds_m;
  sds_m.reserve(stitched.vertices.size());
  for (const StitchedVertex& vertex : stitched.vertices) sds_m.push_back(vertex.sd_m);
  return sds_m;
}

std::size_t make_manifold(StitchedMesh& stitched) {
  const std::size_t vertices = stitched.vertices.size();
  const std::size_t dropped = drop_conflicts(stitched.triangles, vertices);
  for (const std::uint32_t vertex :
       part_fans(stitched.triangles, vertices, pair_edges(stitched.triangles, vertices))) {
    const StitchedVertex copy = stitched.vertices[vertex];
    stitched.vertices.push_back(copy);
  }
  return dropped;
}

std::vector<std::uint32_t> split_edges(StitchedMesh& stitched, std::span<const EdgePlace> places) {
  const auto share_from_lower = [&](std::size_t i) {
    const EdgePlace& place = places[i];
    return place.from < place.to ? place.share : 1 - place.share;
  };
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    return std::tuple(key_of(places[a].from, places[a].to), share_from_lower(a), a) <
           std::tuple(key_of(places[b].from, places[b].to), share_from_lower(b), b);
  });
  std::vector<std::uint32_t> numbers(places.size());
  std::vector<char> is_end(stitched.vertices.size());
  OnEdges on_edges;
  for (const std::size_t i : order) {
    const EdgePlace& place = places[i];
    numbers[i] = static_cast<std::uint32_t>(stitched.vertices.size());
    stitched.vertices.push_back(
        between(stitched.vertices[place.from], stitched.vertices[place.to], place.share));
    on_edges[key_of(place.from, place.to)].push_back(numbers[i]);
    is_end[place.from] = is_end[place.to] = 1;
  }
  for (std::size_t i = 0, count = stitched.triangles.size(); i < count; ++i) {
    const glm::uvec3 t = stitched.triangles[i];
    if (is_end[t.x] + is_end[t.y] + is_end[t.z] < 2) continue;
    const std::vector<std::uint32_t> loop = loop_of(t, on_edges);
    if (loop.size() > 3) cut(stitched, i, loop);
  }
  return numbers;
}

}  // namespace groundray
