#include "terrain/scatter/row_lattice.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/error.h"
#include "core/math.h"

namespace groundray {

RowLattice::RowLattice(const Rows& rows, glm::dvec2 origin_w_m)
    : spacing_m_(rows.within_m, rows.between_m), jitter_m_(rows.jitter_m) {
  const double azimuth_rad = rows.azimuth_deg * std::numbers::pi / 180;
  along_ = {math::sin(azimuth_rad), math::cos(azimuth_rad)};
  across_ = {along_.y, -along_.x};
  const glm::dvec2 from_w_m(glm::dot(origin_w_m, along_), glm::dot(origin_w_m, across_));
  origin_site_ = glm::floor(from_w_m / spacing_m_);
  origin_m_ = from_w_m - origin_site_ * spacing_m_;
}

glm::dvec2 RowLattice::site(glm::ivec2 index) const noexcept {
  const glm::dvec2 at_m = (glm::dvec2(index) - origin_site_) * spacing_m_ - origin_m_;
  return at_m.x * along_ + at_m.y * across_;
}

glm::dvec2 RowLattice::to_lattice(glm::dvec2 p) const noexcept {
  const glm::dvec2 at_m = glm::dvec2(glm::dot(p, along_), glm::dot(p, across_)) + origin_m_;
  return at_m / spacing_m_ + origin_site_;
}

RowLattice::Range RowLattice::sites_of(const Area& area) const {
  const glm::dvec2 low_m = area.low_m - jitter_m_, high_m = area.high_m + jitter_m_;
  const glm::dvec2 a = to_lattice(low_m), b = to_lattice({high_m.x, low_m.y});
  const glm::dvec2 c = to_lattice(high_m), d = to_lattice({low_m.x, high_m.y});
  const glm::dvec2 first = glm::floor(glm::min(glm::min(a, b), glm::min(c, d)) - 1e-6);
  const glm::dvec2 end = glm::floor(glm::max(glm::max(a, b), glm::max(c, d)) + 1e-6) + 1.0;
  constexpr double most = 1 << 28;
  if (!(std::min(first.x, first.y) > -most && std::max(end.x, end.y) < most)) {
    throw Error(
        "rows: sites {} x {} m apart cannot be numbered so far from W's origin; make the spacing "
        "larger",
        spacing_m_.x, spacing_m_.y);
  }
  return {glm::ivec2(first), glm::ivec2(end)};
}

}  // namespace groundray
