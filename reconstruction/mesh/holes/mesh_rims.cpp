#include "reconstruction/mesh/holes/mesh_rims.h"

#include <numeric>

namespace groundray {
namespace {

// Cuts a walk along the boundary, which may pass a vertex several times, into chains that do not.
class ChainCutter {
 public:
  ChainCutter(const TriangleMesh& mesh, MeshRims& rims)
      : mesh_(mesh), rims_(rims), places_(mesh.vertices_m.size(), none) {}

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
      rims_.next[chain[i]] = chain[(i + 1) % chain.size()];
      places_[corner_of(mesh_.triangles, next_of(chain[i]))] = none;
    }
    rims_.chains.push_back(chain);
  }

  const TriangleMesh& mesh_;
  MeshRims& rims_;
  std::vector<std::uint32_t> places_;  // by end vertex: index of a half-edge in `open_`
  std::vector<HalfEdge> open_;
};

}  // namespace

MeshRims find_rims(const TriangleMesh& mesh, const EdgePairs& pairs) {
  MeshRims rims;
  rims.next.assign(pairs.twins.size(), none);
  ChainCutter cutter(mesh, rims);
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
  return rims;
}

VertexStars::VertexStars(const TriangleMesh& mesh, const EdgePairs& pairs)
    : begins_(mesh.vertices_m.size() + 1) {
  const auto half_edges = static_cast<HalfEdge>(pairs.twins.size());
  for (HalfEdge h = 0; h < half_edges; ++h) {
    if (!pairs.is_dropped[h / 3]) ++begins_[corner_of(mesh.triangles, h) + 1];
  }
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  half_edges_.resize(begins_.back());
  std::vector<std::uint32_t> ends(begins_.begin(), begins_.end() - 1);
  for (HalfEdge h = 0; h < half_edges; ++h) {
    if (!pairs.is_dropped[h / 3]) half_edges_[ends[corner_of(mesh.triangles, h)]++] = h;
  }
}

bool VertexStars::has_edge(const TriangleMesh& mesh, std::uint32_t a,
                           std::uint32_t b) const noexcept {
  for (const HalfEdge h : at(a)) {
    if (corner_of(mesh.triangles, next_of(h)) == b || corner_of(mesh.triangles, before(h)) == b)
      return true;
  }
  return false;
}

}  // namespace groundray
