#include "reconstruction/mesh/simplify/collapsible_mesh.h"

#include <array>

namespace groundray {
namespace {

/// Triangles of a star at the spoke to ring[to]: the one that it begins and the one that it ends,
/// as half-edges from the centre; `none` beyond the boundary.
struct Beside {
  HalfEdge begun = none, ended = none;

  Beside(const Star& star, std::size_t to) {
    const std::size_t count = star.spokes.size();
    if (to < count) begun = star.spokes[to];
    if (to > 0) ended = star.spokes[to - 1];
    if (to == 0 && !star.is_open()) ended = star.spokes[count - 1];
  }
};

}  // namespace

CollapsibleMesh::CollapsibleMesh(const ManifoldMesh& mesh)
    : halves_(mesh.pairs.twins.size()),
      first_(mesh.sources.size(), none),
      triangles_(mesh.shape.triangles.size()) {
  for (HalfEdge h = 0; h < halves_.size(); ++h) {
    const std::uint32_t from = mesh.shape.triangles[h / 3][static_cast<int>(h % 3)];
    halves_[h] = {from, mesh.pairs.twins[h]};
    if (first_[from] == none || halves_[h].twin == none) first_[from] = h;
  }
}

void CollapsibleMesh::gather(std::uint32_t vertex, Star& star) const {
  star.centre = vertex;
  star.ring.clear();
  star.spokes.clear();
  const HalfEdge first = first_[vertex];
  HalfEdge h = first;
  do {
    star.ring.push_back(to(h));
    star.spokes.push_back(h);
    const HalfEdge last = before(h);
    h = halves_[last].twin;
    if (h == none) star.ring.push_back(halves_[last].from);
  } while (h != none && h != first);
}

bool CollapsibleMesh::may_collapse(const Star& star, std::size_t to_index) const {
  const Beside beside(star, to_index);
  std::uint32_t apex = none, other_apex = none;
  if (const HalfEdge h = beside.begun; h != none) {
    if (halves_[next_of(h)].twin == none && halves_[before(h)].twin == none) return false;
    apex = halves_[before(h)].from;
  }
  if (const HalfEdge h = beside.ended; h != none) {
    if (halves_[next_of(h)].twin == none && halves_[h].twin == none) return false;
    other_apex = to(h);
  }
  if (apex == other_apex) return false;
  const std::uint32_t onto = star.ring[to_index];
  if (!star.is_open() && star.spokes.size() == 3) {  // the remaining triangle may exist already
    const HalfEdge beyond = halves_[next_of(star.spokes[(to_index + 1) % 3])].twin;
    if (beyond != none && halves_[before(beyond)].from == onto) return false;
  }
  return !shares_others(star, onto, apex, other_apex);
}

// Returns true if a neighbour of the star's centre, except for the apexes, is also one of `onto`.
bool CollapsibleMesh::shares_others(const Star& star, std::uint32_t onto, std::uint32_t apex,
                                    std::uint32_t other_apex) const {
  const auto is_other = [&](std::uint32_t vertex) {
    return vertex != apex && vertex != other_apex &&
           std::find(star.ring.begin(), star.ring.end(), vertex) != star.ring.end();
  };
  const HalfEdge first = first_[onto];
  HalfEdge h = first;
  do {
    if (is_other(to(h))) return true;
    const HalfEdge last = before(h);
    h = halves_[last].twin;
    if (h == none && is_other(halves_[last].from)) return true;
  } while (h != none && h != first);
  return false;
}

void CollapsibleMesh::join(HalfEdge a, HalfEdge b) noexcept {
  if (a != none) halves_[a].twin = b;
  if (b != none) halves_[b].twin = a;
}

// Records the half-edge with which the star of a half-edge's vertex begins.
void CollapsibleMesh::start_at(HalfEdge h) noexcept {
  HalfEdge start = h;
  while (halves_[start].twin != none) {
    start = next_of(halves_[start].twin);
    if (start == h) break;
  }
  first_[halves_[h].from] = start;
}

void CollapsibleMesh::collapse(const Star& star, std::size_t to_index) {
  const Beside beside(star, to_index);
  // In each vanishing triangle, the edge at the centre and the opposite edge become one. The
  // half-edges beyond both lead to the stars of the triangle's other corners.
  std::array<HalfEdge, 8> starts;
  starts.fill(none);
  std::size_t count = 0;
  const auto close = [&](HalfEdge outer, HalfEdge inner) {
    join(outer, inner);
    for (const HalfEdge h : {outer, inner}) {
      if (h == none) continue;
      starts[count++] = h;
      starts[count++] = next_of(h);
    }
  };
  if (const HalfEdge h = beside.begun; h != none)
    close(halves_[next_of(h)].twin, halves_[before(h)].twin);
  if (const HalfEdge h = beside.ended; h != none) close(halves_[next_of(h)].twin, halves_[h].twin);
  for (const HalfEdge h : star.spokes) halves_[h].from = star.ring[to_index];
  for (const HalfEdge h : {beside.begun, beside.ended}) {
    if (h == none) continue;
    for (HalfEdge k = h - h % 3; k < h - h % 3 + 3; ++k) halves_[k].from = none;
    --triangles_;
  }
  first_[star.centre] = none;
  for (std::size_t i = 0; i < count; ++i) {
    if (halves_[starts[i]].from != none) start_at(starts[i]);
  }
}

}  // namespace groundray
