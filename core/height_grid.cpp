#include "core/height_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

struct HeightRange {
  float low_m = std::numeric_limits<float>::infinity();
  float high_m = -std::numeric_limits<float>::infinity();
  std::size_t holes = 0;
};

HeightRange range_of(std::span<const float> heights_m) {
  HeightRange range;
  for (const float height_m : heights_m) {
    range.low_m = std::min(range.low_m, height_m);  // NaN loses every comparison
    range.high_m = std::max(range.high_m, height_m);
    range.holes += std::isnan(height_m) ? 1 : 0;
  }
  return range;
}

// Lines of one family (u, v or u+v = whole number) in the order in which a ray crosses them.
class Lines {
 public:
  Lines(double start, double slope, double t_begin_m) : start_(start), slope_(slope) {
    if (slope == 0) return;
    const double here = start + t_begin_m * slope;
    line_ = slope > 0 ? std::floor(here) + 1 : std::ceil(here) - 1;
    place();
  }
  double next_m() const { return next_m_; }
  double line() const { return line_; }
  void advance() {
    line_ += slope_ > 0 ? 1 : -1;
    place();
  }

 private:
  void place() { next_m_ = (line_ - start_) / slope_; }

  double start_;
  double slope_;
  double line_ = 0;
  double next_m_ = std::numeric_limits<double>::infinity();
};

// How far a ray is above the surface, where it can be asked cheaply: on lines, where two samples
// decide.
class Clearance {
 public:
  Clearance(const HeightGrid& grid, const GridRay& ray) : grid_(grid), ray_(ray) {}

  Facet facet(double t_m) const {
    const double u = ray_.u0 + t_m * ray_.du;
    const double v = ray_.v0 + t_m * ray_.dv;
    const int column = cell(u, grid_.columns());
    const int row = cell(v, grid_.rows());
    return {column, row, u - column + (v - row) > 1 ? Facet::Half::Far : Facet::Half::Near};
  }
  FacetPlane plane(const Facet& facet) const { return grid_.plane(facet); }
  double over_m(const FacetPlane& plane, double t_m) const {
    const double u = ray_.u0 + t_m * ray_.du;
    const double v = ray_.v0 + t_m * ray_.dv;
    return height_m(t_m) - (plane.height_m + plane.u_slope_m * u + plane.v_slope_m * v);
  }
  double inside_m(double t_m) const { return over_m(plane(facet(t_m)), t_m); }
  double on_column_m(double t_m, double line) const {
    const double v = ray_.v0 + t_m * ray_.dv;
    const int row = cell(v, grid_.rows());
    const int column = static_cast<int>(line);
    return above_m(t_m, grid_.height_m(column, row), grid_.height_m(column, row + 1), v - row);
  }
  double on_row_m(double t_m, double line) const {
    const double u = ray_.u0 + t_m * ray_.du;
    const int column = cell(u, grid_.columns());
    const int row = static_cast<int>(line);
    return above_m(t_m, grid_.height_m(column, row), grid_.height_m(column + 1, row), u - column);
  }
  double on_diagonal_m(double t_m, double line) const {
    const int sum = static_cast<int>(line);
    // The lines through the first and the last sample only touch a corner of the grid.
    if (sum < 1 || sum > grid_.columns() + grid_.rows() - 3) return inside_m(t_m);
    const double u = ray_.u0 + t_m * ray_.du;
    const int column = std::clamp(cell(u, grid_.columns()), std::max(0, sum - grid_.rows() + 1),
                                  std::min(grid_.columns() - 2, sum - 1));
    const int row = sum - 1 - column;
    return above_m(t_m, grid_.height_m(column, row + 1), grid_.height_m(column + 1, row),
                   u - column);
  }

 private:
  static int cell(double coordinate, int samples) {
    return std::clamp(static_cast<int>(std::floor(coordinate)), 0, samples - 2);
  }
  double height_m(double t_m) const { return ray_.z0 + t_m * ray_.dz; }
  double above_m(double t_m, double first_m, double second_m, double share) const {
    return height_m(t_m) - (first_m + (second_m - first_m) * share);
  }

  const HeightGrid& grid_;
  const GridRay& ray_;
};

// Whether the facet between two neighbouring lines is crossed from above. On a line next to a hole
// the height may be unknown where the facet's own is not (a ray along the line); then the facet's
// plane is asked at both ends.
bool comes_down(const Clearance& clearance, const Facet& facet, double begin_m,
                double above_begin_m, double end_m, double above_end_m) {
  if (!std::isnan(above_begin_m) && !std::isnan(above_end_m))
    return above_begin_m >= 0 && above_end_m < 0;
  const FacetPlane plane = clearance.plane(facet);
  return clearance.over_m(plane, begin_m) >= 0 && clearance.over_m(plane, end_m) < 0;
}

}  // namespace

HeightGrid::HeightGrid(glm::ivec2 size, glm::dvec2 origin_m, glm::dvec2 step_m,
                       std::vector<float> heights_m)
    : size_(size), origin_m_(origin_m), step_m_(step_m), cells_per_m_(1.0 / step_m) {
  Violations broken("height grid");
  broken.unless(size.x >= 2 && size.y >= 2, "{} x {} samples; a surface needs at least 2 x 2",
                size.x, size.y);
  broken.unless(
      std::isfinite(step_m.x) && std::isfinite(step_m.y) && step_m.x != 0 && step_m.y != 0,
      "step = ({}, {}) m must be finite and not 0", step_m.x, step_m.y);
  broken.unless(std::isfinite(origin_m.x) && std::isfinite(origin_m.y),
                "origin = ({}, {}) m must be finite", origin_m.x, origin_m.y);
  broken.unless(
      size.x < 0 || size.y < 0 ||
          heights_m.size() == static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y),
      "{} heights for {} x {} samples", heights_m.size(), size.x, size.y);
  const HeightRange range = range_of(heights_m);
  broken.unless(heights_m.empty() || range.holes == heights_m.size() ||
                    (std::isfinite(range.low_m) && std::isfinite(range.high_m)),
                "a height is infinite; mark samples without a height as NaN");
  broken.throw_if_any();

  hole_count_ = range.holes;
  if (hole_count_ < heights_m.size()) {
    min_height_m_ = range.low_m;
    max_height_m_ = range.high_m;
  }
  heights_m_ = std::make_shared<const std::vector<float>>(std::move(heights_m));
  samples_ = heights_m_->data();
}

std::optional<double> HeightGrid::height_m_at(glm::dvec2 p) const noexcept {
  const glm::dvec2 at = to_grid(p);
  if (!(0 <= at.x && at.x <= size_.x - 1 && 0 <= at.y && at.y <= size_.y - 1)) return std::nullopt;
  const GridRay down{at.x, at.y, 0, 0, 0, -1};
  const double height_m = -Clearance(*this, down).inside_m(0);
  return std::isnan(height_m) ? std::nullopt : std::optional(height_m);
}

GridRay HeightGrid::to_grid(const glm::dvec3& origin, const glm::dvec3& direction) const noexcept {
  const glm::dvec2 at = to_grid(glm::dvec2(origin));
  return {at.x,       at.y, origin.z, direction.x * cells_per_m_.x, direction.y * cells_per_m_.y,
          direction.z};
}

glm::dvec3 HeightGrid::normal(const FacetPlane& plane) const noexcept {
  return glm::normalize(
      glm::dvec3(-plane.u_slope_m * cells_per_m_.x, -plane.v_slope_m * cells_per_m_.y, 1));
}

std::optional<glm::dvec2> HeightGrid::overlap(const GridRay& ray, double far_m) const noexcept {
  double t_begin_m = 0;
  double t_end_m = far_m;
  clip_range(ray.u0, ray.du, 0, size_.x - 1, t_begin_m, t_end_m);
  clip_range(ray.v0, ray.dv, 0, size_.y - 1, t_begin_m, t_end_m);
  if (!(t_begin_m <= t_end_m)) return std::nullopt;
  return glm::dvec2(t_begin_m, t_end_m);
}

double HeightGrid::clearance_m(const GridRay& ray, double t_m) const noexcept {
  return Clearance(*this, ray).inside_m(t_m);
}

std::optional<Crossing> HeightGrid::first_crossing(const GridRay& ray, double t_begin_m,
                                                   double t_end_m) const noexcept {
  const auto part = overlap(ray, t_end_m);
  if (!part) return std::nullopt;
  t_begin_m = std::max(t_begin_m, part->x);
  t_end_m = part->y;

  const Clearance clearance(*this, ray);
  Lines columns(ray.u0, ray.du, t_begin_m);
  Lines rows(ray.v0, ray.dv, t_begin_m);
  Lines diagonals(ray.u0 + ray.v0, ray.du + ray.dv, t_begin_m);
  double t_m = t_begin_m;
  double above_m = clearance.inside_m(t_m);
  while (t_m < t_end_m) {
    const double before_m = t_m;
    const double above_before_m = above_m;
    if (std::min({columns.next_m(), rows.next_m(), diagonals.next_m()}) >= t_end_m) {
      t_m = t_end_m;
      // A ray without end (straight down, over one facet) is followed just past the lowest height.
      if (std::isinf(t_m)) t_m = std::max(t_begin_m, (min_height_m_ - 1 - ray.z0) / ray.dz);
      above_m = clearance.inside_m(t_m);
      t_end_m = t_m;
    } else if (columns.next_m() <= rows.next_m() && columns.next_m() <= diagonals.next_m()) {
      t_m = columns.next_m();
      above_m = clearance.on_column_m(t_m, columns.line());
      columns.advance();
    } else if (rows.next_m() <= diagonals.next_m()) {
      t_m = rows.next_m();
      above_m = clearance.on_row_m(t_m, rows.line());
      rows.advance();
    } else {
      t_m = diagonals.next_m();
      above_m = clearance.on_diagonal_m(t_m, diagonals.line());
      diagonals.advance();
    }
    if (above_before_m < 0 || above_m >= 0) continue;  // stays below, stays above, or comes up
    const Facet facet = clearance.facet((before_m + t_m) / 2);
    if (!comes_down(clearance, facet, before_m, above_before_m, t_m, above_m)) continue;
    const double range_m = intersect(ray, plane(facet));
    if (std::isnan(range_m)) continue;
    return Crossing{std::clamp(range_m, std::min(before_m, t_m), std::max(before_m, t_m)), facet};
  }
  return std::nullopt;
}

}  // namespace groundray
