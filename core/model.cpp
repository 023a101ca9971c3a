#include "core/model.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <tuple>

#include "core/error.h"

namespace groundray {
namespace {

/// Returns the index of the first element that is not as it must be, or the count of all.
template <typename T, typename Rule>
std::size_t first_breach(const std::vector<T>& all, const Rule& holds) {
  return static_cast<std::size_t>(std::ranges::find_if_not(all, holds) - all.begin());
}

bool less(const glm::dvec3& a, const glm::dvec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Numbers the vertices so that those at equal positions have equal numbers.
std::vector<std::uint32_t> place_numbers(const std::vector<glm::dvec3>& vertices_m) {
  std::vector<std::uint32_t> order(vertices_m.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return less(vertices_m[a], vertices_m[b]); });
  std::vector<std::uint32_t> places(vertices_m.size());
  for (std::size_t i = 1; i < order.size(); ++i) {
    places[order[i]] =
        places[order[i - 1]] + (vertices_m[order[i]] != vertices_m[order[i - 1]] ? 1u : 0u);
  }
  return places;
}

struct Edge {
  std::uint32_t low, high;  // places
  std::uint32_t triangle;
  int side;
};

}  // namespace

void check_model(const Model& model, const std::string& name) {
  const auto& [mesh, uv, normals, surface_of, surfaces] = model;
  const std::size_t vertices = mesh.vertices_m.size(), triangles = mesh.triangles.size();
  constexpr double most_m = std::numeric_limits<float>::max();
  const std::size_t bad_vertex = first_breach(mesh.vertices_m, [](const glm::dvec3& p) {
    return std::abs(p.x) <= most_m && std::abs(p.y) <= most_m && std::abs(p.z) <= most_m;
  });
  const std::size_t bad_triangle = first_breach(mesh.triangles, [&](const glm::uvec3& t) {
    return std::max({t.x, t.y, t.z}) < vertices;
  });
  const std::size_t bad_uv =
      first_breach(uv, [](const glm::vec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
  const std::size_t bad_normal = first_breach(
      normals, [](const glm::vec3& n) { return std::abs(glm::length(n) - 1) <= 1e-3f; });
  const std::size_t bad_surface =
      first_breach(surface_of, [&](std::uint16_t s) { return s < surfaces.size(); });
  Violations broken(name);
  broken.unless(triangles > 0, "there is no triangle");
  broken.unless(!surfaces.empty(), "there is no surface");
  broken.unless(mesh.levels.empty(), "a model has no levels");
  broken.unless(bad_vertex == vertices, "vertex {} must have a finite position", bad_vertex);
  broken.unless(bad_triangle == triangles, "triangle {} names a vertex beyond the last of {}",
                bad_triangle, vertices);
  broken.unless(uv.empty() || uv.size() == vertices, "there are {} uv for {} vertices", uv.size(),
                vertices);
  broken.unless(bad_uv == uv.size(), "vertex {} must have finite uv", bad_uv);
  broken.unless(normals.empty() || normals.size() == vertices,
                "there are {} normals for {} vertices", normals.size(), vertices);
  broken.unless(bad_normal == normals.size(), "vertex {} must have a normal of length 1",
                bad_normal);
  broken.unless(surface_of.size() == triangles, "there are {} surfaces for {} triangles",
                surface_of.size(), triangles);
  broken.unless(bad_surface == surface_of.size(),
                "triangle {} names a surface beyond the last of {}", bad_surface, surfaces.size());
  broken.throw_if_any();
}

ModelBounds bounds_of(const TriangleMesh& mesh) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  ModelBounds bounds{glm::dvec3(infinity), glm::dvec3(-infinity)};
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      bounds.low_m = glm::min(bounds.low_m, mesh.vertices_m[t[k]]);
      bounds.high_m = glm::max(bounds.high_m, mesh.vertices_m[t[k]]);
    }
  }
  return bounds;
}

std::vector<glm::uvec3> neighbours_of(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> places = place_numbers(mesh.vertices_m);
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = places[mesh.triangles[i][k]];
      const std::uint32_t b = places[mesh.triangles[i][(k + 1) % 3]];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b), i, k});
    }
  }
  const auto ends = [](const Edge& e) { return std::tie(e.low, e.high); };
  std::ranges::sort(edges, [&](const Edge& a, const Edge& b) { return ends(a) < ends(b); });
  std::vector<glm::uvec3> neighbours(mesh.triangles.size(), glm::uvec3(no_neighbour));
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last =
        std::find_if(first, edges.end(), [&](const Edge& e) { return ends(e) != ends(*first); });
    if (last - first == 2 && first->triangle != first[1].triangle) {
      neighbours[first->triangle][first->side] = first[1].triangle;
      neighbours[first[1].triangle][first[1].side] = first->triangle;
    }
    first = last;
  }
  return neighbours;
}

}  // namespace groundray
