#include "reconstruction/mesh/simplify/bounds/border_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numeric>

namespace groundray {
namespace {

double twice_area_m2(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

}  // namespace

BorderGrid::BorderGrid(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m) {
  std::vector<Entry> found;
  const auto half_edges = static_cast<HalfEdge>(3 * mesh.numbers());
  for (HalfEdge h = 0; h < half_edges; ++h) {
    if (mesh.twin(h) == none) found.push_back({mesh.from(h), glm::dvec2(places_m[mesh.from(h)])});
  }
  if (!found.empty()) {
    glm::dvec2 high_m = low_m_ = found[0].p_m;
    for (const Entry& entry : found) {
      low_m_ = glm::min(low_m_, entry.p_m);
      high_m = glm::max(high_m, entry.p_m);
    }
    const glm::dvec2 size_m = high_m - low_m_;
    const double count = static_cast<double>(found.size());
    cell_m_ = std::max(std::sqrt(size_m.x * size_m.y / count), (size_m.x + size_m.y) / count);
    if (!(cell_m_ > 0)) cell_m_ = 1;
    cells_ = glm::ivec2(size_m / cell_m_) + 1;
  }
  const auto bucket_of = [&](const Entry& entry) {
    const glm::ivec2 cell = cell_of(entry.p_m);
    return static_cast<std::size_t>(cell.y) * static_cast<std::size_t>(cells_.x) +
           static_cast<std::size_t>(cell.x);
  };
  begins_.resize(static_cast<std::size_t>(cells_.x) * static_cast<std::size_t>(cells_.y) + 1);
  for (const Entry& entry : found) ++begins_[bucket_of(entry) + 1];
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  std::vector<std::uint32_t> at(begins_.begin(), begins_.end() - 1);
  entries_.resize(found.size());
  for (const Entry& entry : found) entries_[at[bucket_of(entry)]++] = entry;
}

glm::ivec2 BorderGrid::cell_of(const glm::dvec2& p_m) const noexcept {
  const glm::dvec2 cell = (p_m - low_m_) / cell_m_;
  return glm::ivec2(glm::clamp(cell, glm::dvec2(0), glm::dvec2(cells_ - 1)));
}

bool BorderGrid::has_any(const CollapsibleMesh& mesh, const std::array<Entry, 3>& corners) const {
  const Entry &a = corners[0], &b = corners[1], &c = corners[2];
  const glm::ivec2 low = cell_of(glm::min(a.p_m, glm::min(b.p_m, c.p_m)));
  const glm::ivec2 high = cell_of(glm::max(a.p_m, glm::max(b.p_m, c.p_m)));
  const auto is_within = [&](const Entry& entry) {
    if (entry.vertex == a.vertex || entry.vertex == b.vertex || entry.vertex == c.vertex)
      return false;
    return mesh.has_vertex(entry.vertex) && twice_area_m2(a.p_m, b.p_m, entry.p_m) >= 0 &&
           twice_area_m2(b.p_m, c.p_m, entry.p_m) >= 0 &&
           twice_area_m2(c.p_m, a.p_m, entry.p_m) >= 0;
  };
  for (int y = low.y; y <= high.y; ++y) {
    for (int x = low.x; x <= high.x; ++x) {
      const std::size_t cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_.x) +
                               static_cast<std::size_t>(x);
      const auto begin = entries_.begin() + begins_[cell],
                 end = entries_.begin() + begins_[cell + 1];
      if (std::any_of(begin, end, is_within)) return true;
    }
  }
  return false;
}

}  // namespace groundray
