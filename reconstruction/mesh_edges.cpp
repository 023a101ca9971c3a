#include "reconstruction/mesh_edges.h"

#include <numeric>

namespace groundray {
namespace {

/// The directed edges that begin at each vertex, in order.
struct EdgesByBegin {
  struct Edge {
    std::uint32_t number = 0, end = 0;
  };
  std::vector<std::uint32_t> first;  // of each vertex, and the end
  std::vector<Edge> edges;

  EdgesByBegin(std::span<const glm::uvec3> triangles, std::size_t vertices)
      : first(vertices + 1), edges(3 * triangles.size()) {
    for (const glm::uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) ++first[t[k] + 1];
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const glm::uvec3& t = triangles[i];
      for (std::uint32_t k = 0; k < 3; ++k)
        edges[next[t[static_cast<int>(k)]]++] = {3 * i + k, t[static_cast<int>((k + 1) % 3)]};
    }
  }

  std::span<const Edge> from(std::uint32_t vertex) const {
    return std::span(edges).subspan(first[vertex], first[vertex + 1] - first[vertex]);
  }

  /// Returns the one edge from `begin` to `end`, or `no_edge` if there is none or there are
  /// several.
  std::uint32_t only(std::uint32_t begin, std::uint32_t end) const {
    std::uint32_t found = no_edge;
    for (const Edge& edge : from(begin)) {
      if (edge.end != end) continue;
      if (found != no_edge) return no_edge;
      found = edge.number;
    }
    return found;
  }
};

/// Triangles that a surface cannot have.
class Conflicts {
 public:
  Conflicts(std::span<const glm::uvec3> triangles, const EdgesByBegin& by_begin)
      : triangles_(triangles), by_begin_(by_begin), is_out_(triangles.size()) {
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const glm::uvec3& t = triangles[i];
      const bool is_flat = t.x == t.y || t.y == t.z || t.z == t.x;
      is_out_[i] = is_flat || !is_first_along_its_edges(i) ? 1 : 0;
    }
  }

  bool is_out(std::uint32_t triangle) const { return is_out_[triangle] != 0; }

  /// Returns for each edge of the others the one that runs back, as edge_twins: there is no more
  /// than one.
  std::vector<std::uint32_t> twins() const {
    std::vector<std::uint32_t> twins(3 * triangles_.size(), no_edge);
    for (std::uint32_t e = 0; e < twins.size(); ++e) {
      if (twins[e] != no_edge || is_out(e / 3)) continue;
      const std::uint32_t begin = edge_begin(triangles_, e);
      for (const EdgesByBegin::Edge& back : by_begin_.from(edge_end(triangles_, e))) {
        if (back.end != begin || is_out(back.number / 3)) continue;
        twins[e] = back.number;
        twins[back.number] = e;
      }
    }
    return twins;
  }

 private:
  bool is_first_along_its_edges(std::uint32_t triangle) const {
    for (std::uint32_t e = 3 * triangle; e < 3 * triangle + 3; ++e) {
      const std::uint32_t end = edge_end(triangles_, e);
      for (const EdgesByBegin::Edge& other : by_begin_.from(edge_begin(triangles_, e))) {
        if (other.number / 3 >= triangle) break;
        if (other.end == end && !is_out(other.number / 3)) return false;
      }
    }
    return true;
  }

  std::span<const glm::uvec3> triangles_;
  const EdgesByBegin& by_begin_;
  std::vector<char> is_out_;
};

/// Visits the corners of one fan, each given as the edge that begins there.
template <typename Visit>
void walk_fan(const std::vector<std::uint32_t>& twins, std::uint32_t corner, const Visit& visit) {
  visit(corner);
  for (std::uint32_t e = corner;;) {  // clockwise, across the edge that begins at the vertex
    const std::uint32_t twin = twins[e];
    if (twin == no_edge) break;
    e = next_edge(twin);
    if (e == corner) return;  // all round
    visit(e);
  }
  for (std::uint32_t e = corner;;) {
    e = twins[edge_before(e)];
    if (e == no_edge) break;
    visit(e);
  }
}

}  // namespace

std::vector<std::uint32_t> edge_twins(std::span<const glm::uvec3> triangles, std::size_t vertices) {
  const EdgesByBegin by_begin(triangles, vertices);
  std::vector<std::uint32_t> twins(3 * triangles.size(), no_edge);
  for (std::uint32_t e = 0; e < twins.size(); ++e) {
    const std::uint32_t begin = edge_begin(triangles, e), end = edge_end(triangles, e);
    if (twins[e] != no_edge || begin == end) continue;
    const std::uint32_t back = by_begin.only(end, begin);
    if (back == no_edge || by_begin.only(begin, end) != e) continue;
    twins[e] = back;
    twins[back] = e;
  }
  return twins;
}

ManifoldFaults make_manifold(std::vector<glm::uvec3>& triangles, std::size_t vertices,
                             std::vector<std::uint32_t>& doubled) {
  const EdgesByBegin by_begin(triangles, vertices);
  const Conflicts conflicts(triangles, by_begin);
  const std::vector<std::uint32_t> twins = conflicts.twins();
  ManifoldFaults faults;
  std::vector<char> is_seen(3 * triangles.size()), is_taken(vertices);
  for (std::uint32_t corner = 0; corner < is_seen.size(); ++corner) {
    if (is_seen[corner] != 0 || conflicts.is_out(corner / 3)) continue;
    std::uint32_t vertex = edge_begin(triangles, corner);
    if (is_taken[vertex] == 0) {
      is_taken[vertex] = 1;
    } else {
      doubled.push_back(vertex);
      vertex = static_cast<std::uint32_t>(vertices + faults.vertices++);
    }
    walk_fan(twins, corner, [&](std::uint32_t e) {
      is_seen[e] = 1;
      triangles[e / 3][static_cast<int>(e % 3)] = vertex;
    });
  }
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    if (!conflicts.is_out(i)) triangles[kept++] = triangles[i];
  }
  faults.triangles = triangles.size() - kept;
  triangles.resize(kept);
  return faults;
}

}  // namespace groundray
