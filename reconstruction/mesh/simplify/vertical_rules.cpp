#include "reconstruction/mesh/simplify/vertical_rules.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/math.h"

namespace groundray {

BorderGrid::BorderGrid(const SurfaceMesh& mesh) {
  for (const auto vertex : mesh.vertices()) {
    if (mesh.is_boundary(vertex))
      entries_.push_back({number_of(vertex), glm::dvec2(mesh.point(vertex))});
  }
  if (!entries_.empty()) {
    glm::dvec2 high_m = low_m_ = entries_[0].p_m;
    for (const Entry& entry : entries_) {
      low_m_ = glm::min(low_m_, entry.p_m);
      high_m = glm::max(high_m, entry.p_m);
    }
    const glm::dvec2 size_m = high_m - low_m_;
    const double count = static_cast<double>(entries_.size());
    cell_m_ = std::max(std::sqrt(size_m.x * size_m.y / count), (size_m.x + size_m.y) / count);
    if (!(cell_m_ > 0)) cell_m_ = 1;
    cells_ = glm::ivec2(size_m / cell_m_) + 1;
  }
  const auto cells = static_cast<std::size_t>(cells_.x) * static_cast<std::size_t>(cells_.y);
  by_cell_ = sorted_in(cells, entries_.size(), [&](std::uint32_t i) {
    const glm::ivec2 cell = cell_of(entries_[i].p_m);
    return static_cast<std::uint32_t>(cell.y * cells_.x + cell.x);
  });
}

glm::ivec2 BorderGrid::cell_of(const glm::dvec2& p_m) const noexcept {
  const glm::dvec2 cell = (p_m - low_m_) / cell_m_;
  return glm::ivec2(glm::clamp(cell, glm::dvec2(0), glm::dvec2(cells_ - 1)));
}

bool BorderGrid::has_any(const SurfaceMesh& mesh, const std::array<Entry, 3>& corners) const {
  const Entry &a = corners[0], &b = corners[1], &c = corners[2];
  const glm::ivec2 low = cell_of(glm::min(a.p_m, glm::min(b.p_m, c.p_m)));
  const glm::ivec2 high = cell_of(glm::max(a.p_m, glm::max(b.p_m, c.p_m)));
  const auto is_within = [&](std::uint32_t number) {
    const Entry& entry = entries_[number];
    if (entry.vertex == a.vertex || entry.vertex == b.vertex || entry.vertex == c.vertex)
      return false;
    const bool is_there = !mesh.status(mesh.vertex_handle(entry.vertex)).deleted();
    return is_there && twice_plan_area_m2(a.p_m, b.p_m, entry.p_m) >= 0 &&
           twice_plan_area_m2(b.p_m, c.p_m, entry.p_m) >= 0 &&
           twice_plan_area_m2(c.p_m, a.p_m, entry.p_m) >= 0;
  };
  for (int y = low.y; y <= high.y; ++y) {
    for (int x = low.x; x <= high.x; ++x) {
      const auto cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_.x) +
                        static_cast<std::size_t>(x);
      if (std::ranges::any_of(by_cell_.at(cell), is_within)) return true;
    }
  }
  return false;
}

VerticalRules::VerticalRules(DecimationState& piece, std::optional<double> border_m,
                             std::vector<bool> stay_covered, double rounding_m, MayJoin may_join)
    : piece_(piece),
      border_m_(border_m),
      stay_covered_(std::move(stay_covered)),
      rounding_m_(rounding_m),
      may_join_(std::move(may_join)),
      lists_(piece.triangles),
      borders_(piece.mesh),
      is_covered_(piece.samples.size()) {
  stay_covered_.resize(piece.samples.size());
  double sum_m2 = 0;
  for (std::uint32_t i = 0; i < piece.triangles; ++i) sum_m2 += twice_plan_area_m2(i);
  // A tenth of the area of a cell, which has two triangles.
  least_m2_ = 0.2 * sum_m2 / static_cast<double>(piece.triangles);
}

double VerticalRules::twice_plan_area_m2(std::uint32_t triangle) const noexcept {
  const glm::uvec3 t = corners_of(piece_.mesh, triangle);
  return groundray::twice_plan_area_m2(piece_.samples[t.x].p_m, piece_.samples[t.y].p_m,
                                       piece_.samples[t.z].p_m);
}

// Computes the slopes of the fan's triangles. Returns false if one has too small an area.
bool VerticalRules::set_fan(const Star& star, std::size_t to) {
  fan_ = Fan(star, to);
  is_open_ = star.is_open();
  tip_m_ = piece_.samples[star.ring[to]].p_m;
  spokes_.resize(fan_.triangles + 1);
  const auto place = [&](std::size_t i) {
    const glm::dvec3 d =
        piece_.samples[star.ring[(fan_.first + i) % star.ring.size()]].p_m - tip_m_;
    spokes_[i] = {.x = d.x, .y = d.y, .z = d.z};
  };
  place(0);
  double smallest_m2 = -1;  // of the star, computed if any triangle is small
  for (std::size_t i = 0; i < fan_.triangles; ++i) {
    place(i + 1);
    Spoke& a = spokes_[i];
    const Spoke& b = spokes_[i + 1];
    const double twice_m2 = a.x * b.y - a.y * b.x;
    if (!(twice_m2 >= least_m2_)) [[unlikely]] {
      if (is_narrow(twice_m2, i)) return false;
      if (!(smallest_m2 >= 0)) smallest_m2 = smallest_of(star);
      if (!(twice_m2 >= smallest_m2)) return false;
    }
    a.slope_x = (a.z * b.y - b.z * a.y) / twice_m2;
    a.slope_y = (a.x * b.z - b.x * a.z) / twice_m2;
  }
  return true;
}

// Returns true if double precision cannot resolve the orientation of a triangle of the fan.
bool VerticalRules::is_narrow(double twice_m2, std::size_t i) const noexcept {
  const Spoke &a = spokes_[i], &b = spokes_[i + 1];
  const double square_m2 = std::max({a.x * a.x + a.y * a.y, b.x * b.x + b.y * b.y});
  return !(twice_m2 > 1e-6 * square_m2);
}

// Small triangles are allowed where there are smaller ones.
double VerticalRules::smallest_of(const Star& star) const noexcept {
  double smallest_m2 = least_m2_;
  for (std::size_t k = 0; k < star.triangles(); ++k)
    smallest_m2 = std::min(smallest_m2, twice_plan_area_m2(star.triangle(k)));
  return smallest_m2;
}

// Returns the triangle of the fan above or below a position relative to the tip.
std::size_t VerticalRules::sector_of(double x, double y) const noexcept {
  double before = spokes_[0].x * y - spokes_[0].y * x;
  for (std::size_t i = 0; i < fan_.triangles; ++i) {
    const Spoke& end = spokes_[i + 1];
    const double after = end.x * y - end.y * x;
    if (before >= 0 && after <= 0) return i;
    before = after;
  }
  return is_open_ ? nowhere : nearest_sector(x, y);
}

// Returns the triangle for a position that is covered except for rounding.
std::size_t VerticalRules::nearest_sector(double x, double y) const noexcept {
  std::size_t nearest = 0;
  double least = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < fan_.triangles; ++i) {
    const Spoke &a = spokes_[i], &b = spokes_[i + 1];
    const double before = (a.x * y - a.y * x) / math::hypot(a.x, a.y);
    const double after = (b.y * x - b.x * y) / math::hypot(b.x, b.y);
    if (std::min(before, after) <= least) continue;
    least = std::min(before, after);
    nearest = i;
  }
  return nearest;
}

// Returns true if a vertex is within its tolerance of the triangle that covers it, or else of the
// boundary's new edge.
bool VerticalRules::is_near(std::uint32_t vertex, std::size_t& sector) const noexcept {
  const Sample& sample = piece_.samples[vertex];
  const double x = sample.p_m.x - tip_m_.x, y = sample.p_m.y - tip_m_.y;
  sector = sector_of(x, y);
  if (sector == nowhere) return is_near_border(vertex);
  const Spoke& spoke = spokes_[sector];
  const double z = spoke.slope_x * x + spoke.slope_y * y;
  return std::abs(sample.p_m.z - tip_m_.z - z) <= static_cast<double>(sample.tolerance_m);
}

double VerticalRules::most_aside_m(std::uint32_t vertex) const noexcept {
  const double border_m = border_m_.value_or(double{piece_.samples[vertex].tolerance_m});
  return stay_covered_[vertex] ? std::min(border_m, rounding_m_) : border_m;
}

// Returns true if the boundary's new edge is near enough, horizontally and vertically.
bool VerticalRules::is_near_border(std::uint32_t vertex) const noexcept {
  const Sample& sample = piece_.samples[vertex];
  const glm::dvec3& other_m = piece_.samples[line_.other_end].p_m;
  const glm::dvec2 edge = glm::dvec2(other_m - tip_m_), from = glm::dvec2(sample.p_m - tip_m_);
  const double share = std::clamp(glm::dot(edge, from) / glm::dot(edge, edge), 0.0, 1.0);
  const double z_m = share * (other_m.z - tip_m_.z);
  return glm::length(from - share * edge) <= most_aside_m(vertex) &&
         std::abs(sample.p_m.z - tip_m_.z - z_m) <= static_cast<double>(sample.tolerance_m);
}

// Returns true if a line's new edge is near enough to all vertices that it represents.
bool VerticalRules::keeps_line() const {
  const glm::dvec3& other_m = piece_.samples[line_.other_end].p_m;
  for (const std::uint32_t vertex : line_.vertices) {
    const Sample& sample = piece_.samples[vertex];
    glm::dvec3 apart = vector_to_edge(sample.p_m, tip_m_, other_m);
    if (line_.kind == LineKind::Crease) {
      if (!(glm::length(apart) <= static_cast<double>(sample.tolerance_m))) return false;
      continue;
    }
    glm::dvec3 flat_m = sample.p_m, flat_tip_m = tip_m_, flat_other_m = other_m;
    flat_m.z = flat_tip_m.z = flat_other_m.z = 0;
    apart = vector_to_edge(flat_m, flat_tip_m, flat_other_m);
    if (!(glm::length(apart) <= most_aside_m(vertex))) return false;
  }
  return true;
}

// A boundary that moves outwards must not reach another. Vertices that were beyond it may become
// covered, and covered ones may come to lie beyond it.
bool VerticalRules::keeps_border(const Star& star, std::size_t to) {
  BorderGrid::Entry tip{line_.onto, glm::dvec2(tip_m_)};
  BorderGrid::Entry end{line_.other_end, glm::dvec2(piece_.samples[line_.other_end].p_m)};
  if (to == 0) std::swap(tip, end);
  const BorderGrid::Entry centre{star.centre, glm::dvec2(piece_.samples[star.centre].p_m)};
  const glm::dvec2 edge = end.p_m - tip.p_m, from = centre.p_m - tip.p_m;
  if (edge.x * from.y - edge.y * from.x > 0 && borders_.has_any(piece_.mesh, {tip, end, centre}))
    return false;
  for (const std::uint32_t vertex : line_.vertices) {
    if (vertex == star.centre || is_covered_[vertex]) continue;  // tested with the others
    const glm::dvec3 d = piece_.samples[vertex].p_m - tip_m_;
    std::size_t sector = sector_of(d.x, d.y);
    if (sector != nowhere) {
      const Spoke &a = spokes_[sector], &b = spokes_[sector + 1];
      if ((b.x - a.x) * (d.y - a.y) - (b.y - a.y) * (d.x - a.x) < 0) sector = nowhere;
    }
    if (sector == nowhere ? !is_near_border(vertex) : !is_near(vertex, sector)) return false;
    if (sector != nowhere) placed_.emplace_back(vertex, sector);
  }
  return true;
}

// Tests all vertices collapsed into the star's triangles. A vertex that fails once tends to fail
// again, so it is tested first.
bool VerticalRules::keeps_samples(const Star& star) {
  std::size_t sector = 0;
  for (std::size_t i = 0; i < star.triangles(); ++i) {
    const std::uint32_t first = lists_.first(star.triangle(i));
    if (first != none && !is_near(first, sector)) return false;
  }
  for (std::size_t i = 0; i < star.triangles(); ++i) {
    std::uint32_t prior = none;
    const std::uint32_t triangle = star.triangle(i);
    for (std::uint32_t vertex = lists_.first(triangle); vertex != none;) {
      if (!is_near(vertex, sector)) {
        if (prior != none) lists_.bring_forward(piece_.samples, triangle, prior);
        return false;
      }
      placed_.emplace_back(vertex, sector);
      prior = vertex;
      vertex = piece_.samples[vertex].next;
    }
  }
  return true;
}

// Returns true if may_join_ permits each edge that the collapse adds: from the tip to all vertices
// of the ring that are not next to it, and one along an open boundary.
bool VerticalRules::may_have_edges(const Star& star, std::size_t to) const {
  if (!may_join_) return true;
  const auto joins = [&](std::uint32_t vertex) { return may_join_(star.ring[to], vertex); };
  for (std::size_t i = 1; i < fan_.triangles; ++i) {
    if (!joins(star.ring[(fan_.first + i) % star.ring.size()])) return false;
  }
  return !is_open_ || joins(to == 0 ? star.ring.back() : star.ring.front());
}

bool VerticalRules::allow(const Star& star, const FeatureLines::Crossing& crossing,
                          std::size_t to) {
  if (!set_fan(star, to)) return false;
  placed_.clear();
  if (crossing.edges == 2) {
    piece_.lines.gather(star, crossing, to, line_);
    if (!keeps_line()) return false;
  }
  std::size_t sector = 0;
  if (!is_near(star.centre, sector)) return false;
  placed_.emplace_back(star.centre, sector);
  if (!may_collapse(star, to)) return false;
  if (is_open_ && !keeps_border(star, to)) return false;
  return keeps_samples(star) && may_have_edges(star, to);
}

void VerticalRules::collapse(const Star& star, const FeatureLines::Crossing& crossing,
                             std::size_t) {
  for (std::size_t i = 0; i < star.triangles(); ++i) lists_.clear(star.triangle(i));
  for (const auto& [vertex, sector] : placed_) {
    is_covered_[vertex] = sector != nowhere;
    if (sector != nowhere) {
      const std::size_t triangle = (fan_.first + sector) % star.triangles();
      lists_.add(piece_.samples, star.triangle(triangle), vertex);
    } else if (vertex != star.centre && !piece_.lines.is_left(vertex)) {
      piece_.lines.add(star.spokes[crossing.spokes[0]], vertex);
    }
  }
}

}  // namespace groundray
