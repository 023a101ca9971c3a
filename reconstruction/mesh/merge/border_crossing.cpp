#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "reconstruction/mesh/merge/zippering.h"

namespace groundray {
namespace {

constexpr std::size_t places_in_block = 256;
constexpr double most_parts = 16;  // into which an edge is divided for sampling
constexpr int halvings = 6;        // bisections of an edge that locate a crossing: to 1/64

bool is_inside(Cover cover) { return cover == Cover::Inside; }

struct Edge {
  std::uint32_t from = 0, to = 0;
};

/// Returns each edge for which `wanted` is true, once.
template <typename Wanted>
std::vector<Edge> edges_where(const StitchedMesh& stitched, const Wanted& wanted) {
  std::vector<std::uint64_t> keys;
  for (const glm::uvec3& t : stitched.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Edge edge{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])};
      if (wanted(edge)) keys.push_back(std::uint64_t{edge.from} << 32 | edge.to);
    }
  }
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<Edge> edges;
  for (const std::uint64_t key : keys)
    edges.push_back({static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)});
  return edges;
}

/// Queries of a surface at positions on a merged mesh.
class BorderSearch {
 public:
  BorderSearch(const StitchedMesh& stitched, const CoverSurface& surface)
      : quilt_(stitched), surface_(surface), answers_(stitched.vertices.size()) {
    ask_from(0);
  }

  const std::vector<CoverAnswer>& answers() const { return answers_; }

  /// Queries the vertices that were added.
  void ask_from(std::size_t first) {
    answers_.resize(quilt_.vertices.size());
    for_blocks(answers_.size() - first, places_in_block, [&](std::size_t begin, std::size_t end) {
      std::uint32_t near = 0;
      for (std::size_t v = first + begin; v < first + end; ++v) {
        if (!quilt_.vertices[v].is_shared) continue;
        answers_[v] = at(quilt_.vertices[v], near);
        near = answers_[v].nearest.triangle;
      }
    });
  }

  /// Returns true if an edge is so long that it may cross the boundary more than once.
  bool is_long(const Edge& edge) const { return parts_of(edge) >= 2; }

  /// Returns the midpoint of each inner run of samples on an edge; a run is covered, or not,
  /// throughout, unlike the runs before and after it.
  std::vector<EdgePlace> runs_within(const Edge& edge) const {
    const double parts = parts_of(edge);
    std::vector<EdgePlace> places;
    bool is_in = is_inside(answers_[edge.from].cover);
    double begin = 0;  // start of the run
    std::uint32_t near = answers_[edge.from].nearest.triangle;
    for (double i = 1; i <= parts; ++i) {
      CoverAnswer answer = answers_[edge.to];
      if (i < parts)
        answer = at(between(quilt_.vertices[edge.from], quilt_.vertices[edge.to], i / parts), near);
      near = answer.nearest.triangle;
      if (is_inside(answer.cover) == is_in) continue;
      is_in = !is_in;
      if (begin > 0) places.push_back({edge.from, edge.to, (begin + i - 1) / 2 / parts});
      begin = i;
    }
    return places;
  }

  BorderCrossing crossing_of(const Edge& edge) const {
    const bool is_from_inside = is_inside(answers_[edge.from].cover);
    BorderCrossing crossing{.inside = is_from_inside ? edge.from : edge.to,
                            .outside = is_from_inside ? edge.to : edge.from};
    const StitchedVertex& inside = quilt_.vertices[crossing.inside];
    const StitchedVertex& outside = quilt_.vertices[crossing.outside];
    CoverAnswer beyond = answers_[crossing.outside];
    double low = 0, high = 1;
    for (int i = 0; i < halvings; ++i) {
      const double middle = (low + high) / 2;
      const CoverAnswer answer = at(between(inside, outside, middle), beyond.nearest.triangle);
      (is_inside(answer.cover) ? low : high) = middle;
      if (!is_inside(answer.cover)) beyond = answer;
    }
    if (beyond.cover == Cover::Border) place(beyond.nearest, crossing);
    return crossing;
  }

 private:
  CoverAnswer at(const StitchedVertex& vertex, std::uint32_t near) const {
    return surface_.at({vertex.p, vertex.normal, vertex.sd_m}, 0, near);
  }

  double parts_of(const Edge& edge) const {
    const StitchedVertex &from = quilt_.vertices[edge.from], &to = quilt_.vertices[edge.to];
    if (!from.is_shared || !to.is_shared) return 0;
    const double area_m2 = std::min(surface_.area_m2(answers_[edge.from].nearest.triangle),
                                    surface_.area_m2(answers_[edge.to].nearest.triangle));
    return std::min(most_parts,
                    std::floor(glm::distance(from.p, to.p) / (4 * std::sqrt(2 * area_m2))));
  }

  /// Assigns a crossing to the nearest boundary edge.
  void place(const NearestPoint& nearest, BorderCrossing& crossing) const {
    const glm::uvec3& t = surface_.mesh().triangles[nearest.triangle];
    const glm::dvec3 shares = shares_of_corners(surface_.mesh(), nearest.triangle, nearest.point);
    double least = 1e-6;  // barycentric coordinate of a point on the edge, at most
    for (int k = 0; k < 3; ++k) {
      const double opposite = shares[(k + 2) % 3];
      if (!(opposite < least) || !surface_.is_border(nearest.triangle, k)) continue;
      least = opposite;
      crossing.from = t[k];
      crossing.to = t[(k + 1) % 3];
      crossing.share = std::clamp(shares[(k + 1) % 3], 0.0, 1.0);
    }
    if (crossing.from != no_vertex) return;
    // At a corner whose boundary edges belong to other triangles.
    crossing.from = crossing.to = t[shares.x > 0.5 ? 0 : shares.y > 0.5 ? 1 : 2];
  }

  const StitchedMesh& quilt_;
  const CoverSurface& surface_;
  std::vector<CoverAnswer> answers_;
};

/// Adds vertices between crossings on edges that cross the boundary more than once.
void split_between_crossings(StitchedMesh& stitched, BorderSearch& search) {
  const std::vector<Edge> edges =
      edges_where(stitched, [&](const Edge& edge) { return search.is_long(edge); });
  std::vector<std::vector<EdgePlace>> found(edges.size());
  for_blocks(edges.size(), places_in_block, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) found[i] = search.runs_within(edges[i]);
  });
  std::vector<EdgePlace> places;
  for (const std::vector<EdgePlace>& on_edge : found)
    places.insert(places.end(), on_edge.begin(), on_edge.end());
  const std::size_t first = stitched.vertices.size();
  split_edges(stitched, places);
  search.ask_from(first);
}

}  // namespace

BorderCrossings find_border_crossings(StitchedMesh& stitched, const CoverSurface& surface) {
  BorderSearch search(stitched, surface);
  split_between_crossings(stitched, search);
  BorderCrossings found;
  for (const CoverAnswer& answer : search.answers()) found.covers.push_back(answer.cover);
  const std::vector<Edge> crossing = edges_where(stitched, [&](const Edge& edge) {
    return is_inside(found.covers[edge.from]) != is_inside(found.covers[edge.to]);
  });
  found.crossings.resize(crossing.size());
  for_blocks(crossing.size(), places_in_block, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) found.crossings[i] = search.crossing_of(crossing[i]);
  });
  return found;
}

}  // namespace groundray
