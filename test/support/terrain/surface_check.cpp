#include "test/support/terrain/surface_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <set>
#include <utility>

namespace groundray::testing {
namespace {

using Edge = std::pair<unsigned, unsigned>;

// Number of triangles along each edge, in each direction.
std::map<Edge, int> runs_of(const TriangleMesh& mesh) {
  std::map<Edge, int> runs;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++runs[{t[k], t[(k + 1) % 3]}];
  }
  return runs;
}

// Number of groups of triangles at a vertex; the members of a group are connected by shared edges.
std::size_t fans_of(const std::vector<Edge>& opposite) {
  std::map<unsigned, std::set<unsigned>> links;
  for (const auto& [a, b] : opposite) {
    links[a].insert(b);
    links[b].insert(a);
  }
  std::size_t fans = 0;
  std::set<unsigned> seen;
  for (const auto& [start, unused] : links) {
    if (!seen.insert(start).second) continue;
    ++fans;
    std::vector<unsigned> open{start};
    while (!open.empty()) {
      const unsigned at = open.back();
      open.pop_back();
      for (const unsigned to : links[at]) {
        if (seen.insert(to).second) open.push_back(to);
      }
    }
  }
  return fans;
}

}  // namespace

std::vector<std::string> surface_faults(const TriangleMesh& mesh) {
  std::vector<std::string> faults;
  std::map<unsigned, std::vector<Edge>> opposite;
  for (const glm::uvec3& t : mesh.triangles) {
    if (std::max({t.x, t.y, t.z}) >= mesh.vertices_m.size())
      return {"a triangle refers to a missing vertex"};
    if (t.x == t.y || t.y == t.z || t.z == t.x)
      faults.push_back(fmt::format("triangle {} {} {}", t.x, t.y, t.z));
    for (int k = 0; k < 3; ++k) opposite[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
  }
  for (const auto& [edge, count] : runs_of(mesh)) {
    if (count > 1)
      faults.push_back(fmt::format("{} run from {} to {}", count, edge.first, edge.second));
  }
  for (const auto& [vertex, edges] : opposite) {
    if (const std::size_t fans = fans_of(edges); fans != 1)
      faults.push_back(fmt::format("vertex {} joins {} fans", vertex, fans));
  }
  return faults;
}

std::ptrdiff_t euler_number(const TriangleMesh& mesh) {
  std::set<unsigned> vertices;
  std::set<Edge> edges;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      vertices.insert(t[k]);
      edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
    }
  }
  return std::ssize(vertices) - std::ssize(edges) + std::ssize(mesh.triangles);
}

std::size_t border_edges(const TriangleMesh& mesh) {
  const std::map<Edge, int> runs = runs_of(mesh);
  return static_cast<std::size_t>(std::ranges::count_if(runs, [&](const auto& run) {
    return !runs.contains({run.first.second, run.first.first});
  }));
}

std::size_t folds_in_plan(const TriangleMesh& mesh) {
  return static_cast<std::size_t>(std::ranges::count_if(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y],
                     &c = mesh.vertices_m[t.z];
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) <= 0;
  }));
}

double area_m2(const TriangleMesh& mesh) {
  double sum_m2 = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3& a = mesh.vertices_m[t.x];
    sum_m2 += 0.5 * glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a));
  }
  return sum_m2;
}

double volume_m3(const TriangleMesh& mesh) {
  double sum_m3 = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    sum_m3 +=
        glm::dot(mesh.vertices_m[t.x], glm::cross(mesh.vertices_m[t.y], mesh.vertices_m[t.z])) / 6;
  }
  return sum_m3;
}

}  // namespace groundray::testing
