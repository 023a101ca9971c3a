#include "core/tracing/level_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace groundray {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double never_m = std::numeric_limits<double>::infinity();  // a range that is not reached

// Returns the t at which a ray leaves a range of coordinates.
double exit_m(double start, double slope, double per_index_m, int low, int high) {
  if (slope == 0) return never_m;
  return ((slope > 0 ? high : low) - start) * per_index_m;
}

FacetPlane plane_at(const Cell& cell, const GridRay& ray, double t_m) {
  return cell.plane(cell.half_at(ray.u0 + t_m * ray.du, ray.v0 + t_m * ray.dv));
}

// Returns the index in [low, high) of the cell that a ray is in at t.
int index_at(double start, double slope, double t_m, int low, int high) {
  AxisWalk axis{start, slope, 1 / slope, low, high, 0, high - low};
  axis.begin(t_m, static_cast<int>(std::clamp<double>(start, low, high - 1)));
  return low + axis.at;
}

int next_index(double slope, int low, int high) { return slope > 0 ? high : low - 1; }

}  // namespace

LevelSurface::LevelSurface(std::vector<const LevelScene::Impl*> levels)
    : levels_(std::move(levels)),
      extent_(levels_.back()->level.frame, levels_.back()->first, levels_.back()->last) {}

// Returns the finest level whose window contains a cell of the DEM, or the outermost.
std::uint32_t LevelSurface::level_at(int column, int row) const noexcept {
  std::uint32_t number = 0;
  while (number + 1 < levels_.size() && !levels_[number]->contains(column, row)) ++number;
  return number;
}

LevelSurface::Place LevelSurface::place_at(int column, int row) const noexcept {
  const std::uint32_t number = level_at(column, row);
  const LevelScene::Impl& level = *levels_[number];
  if (const Leaf* leaf = level.leaf_at(column, row)) {
    const int exponent = level.deciding_exponent(*leaf);
    return {leaf, number, exponent, LeafCells{level, *leaf, exponent}.cell_at(column, row)};
  }
  const glm::ivec2 first = level.level.first;
  const int mask = (1 << level.block_exponent) - 1;
  Cell none{column - ((column - first.x) & mask), row - ((row - first.y) & mask)};
  none.width = std::min(mask + 1, level.last.x - none.column);
  none.height = std::min(mask + 1, level.last.y - none.row);
  none.nw = none.ne = none.sw = none.se = nan;
  return {nullptr, number, 0, none};
}

void LevelSurface::move(Place& place, int column, int row) const noexcept {
  if (place.leaf != nullptr) {
    const LevelScene::Impl& level = *levels_[place.level];
    const auto size = static_cast<unsigned>(level.level.leaf_cells * place.leaf->step);
    if (static_cast<unsigned>(column - place.leaf->column) < size &&
        static_cast<unsigned>(row - place.leaf->row) < size) {
      place.cell = LeafCells{level, *place.leaf, place.exponent}.cell_at(column, row);
      return;
    }
  }
  place = place_at(column, row);
}

LevelSurface::Place LevelSurface::start(const GridRay& ray, double t_m) const noexcept {
  const LevelView& all = *levels_.back();
  return place_at(index_at(ray.u0, ray.du, t_m, all.first.x, all.last.x),
                  index_at(ray.v0, ray.dv, t_m, all.first.y, all.last.y));
}

LevelSurface::Extent LevelSurface::cell_extent(const Place& place) noexcept {
  return {place.cell.column, place.cell.row, place.cell.width, place.cell.height};
}

LevelSurface::Extent LevelSurface::leaf_extent(const Place& place) const noexcept {
  if (place.leaf == nullptr) return cell_extent(place);
  const Level& level = levels_[place.level]->level;
  const int side = level.leaf_cells * place.leaf->step;
  const glm::ivec2 last = level.frame.samples - 1;
  return {place.leaf->column, place.leaf->row, std::min(side, last.x - place.leaf->column),
          std::min(side, last.y - place.leaf->row)};
}

template <typename ExtentOf, typename Act>
void LevelSurface::walk(const GridRay& ray, double t_begin_m, double t_end_m,
                        const ExtentOf& extent_of, const Act& act) const noexcept {
  const LevelScene::Impl& all = *levels_.back();
  const glm::ivec2 first = all.level.first;
  clip_range(ray.u0, ray.du, first.x, all.last.x, t_begin_m, t_end_m);
  clip_range(ray.v0, ray.dv, first.y, all.last.y, t_begin_m, t_end_m);
  if (!(t_begin_m <= t_end_m)) return;
  Place place = start(ray, t_begin_m);
  const double per_column_m = 1 / ray.du;
  const double per_row_m = 1 / ray.dv;
  for (double t_m = t_begin_m;;) {
    const Extent at = extent_of(place);
    const double column_exit_m =
        exit_m(ray.u0, ray.du, per_column_m, at.column, at.column + at.width);
    const double row_exit_m = exit_m(ray.v0, ray.dv, per_row_m, at.row, at.row + at.height);
    const double leave_m = std::max(t_m, std::min(column_exit_m, row_exit_m));
    if (act(place, t_m, std::min(leave_m, t_end_m)) || !(leave_m < t_end_m)) return;
    int column, row;
    if (column_exit_m <= row_exit_m) {
      column = next_index(ray.du, at.column, at.column + at.width);
      row = index_at(ray.v0, ray.dv, leave_m, at.row, at.row + at.height);
      if (column < first.x || column >= all.last.x) return;
    } else {
      row = next_index(ray.dv, at.row, at.row + at.height);
      column = index_at(ray.u0, ray.du, leave_m, at.column, at.column + at.width);
      if (row < first.y || row >= all.last.y) return;
    }
    t_m = leave_m;
    move(place, column, row);
  }
}

double LevelSurface::clearance_m(const GridRay& ray, double t_m) const noexcept {
  const Cell cell = start(ray, t_m).cell;
  const double u = ray.u0 + t_m * ray.du;
  const double v = ray.v0 + t_m * ray.dv;
  return groundray::clearance_m(ray, cell.plane(cell.half_at(u, v)), t_m);
}

LevelSurface::PlainFacet LevelSurface::plain_facet_at(double u, double v) const noexcept {
  const LevelView& all = *levels_.back();
  if (!(all.first.x <= u && u < all.last.x && all.first.y <= v && v < all.last.y)) return {};
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const LevelScene::Impl& level = *levels_[level_at(column, row)];
  const Leaf* leaf = level.leaf_at(column, row);
  if (leaf == nullptr) return {};
  const int exponent = level.deciding_exponent(*leaf), step = 1 << exponent;
  if (leaf->coarser != 0 && step == leaf->step) return {};
  const int west = leaf->column + ((column - leaf->column) & -step);
  const int north = leaf->row + ((row - leaf->row) & -step);
  if (west + step > level.last.x || north + step > level.last.y) return {};
  const Half half = u - west + (v - north) > step ? Half::Far : Half::Near;
  return {&level, {west, north, static_cast<std::int8_t>(exponent), half, leaf->deviation_m}};
}

namespace {

// Returns the first t from t_in on at which a ray is `above_m` above both planes of a cell;
// infinite if never.
double rises_to(const Cell& cell, const GridRay& ray, double above_m, double t_in) {
  double rise_m = t_in;
  for (const Half half : {Half::Near, Half::Far}) {
    const FacetPlane plane = cell.plane(half);
    const double lacks_m = above_m - clearance_m(ray, plane, t_in);
    if (lacks_m <= 0 || std::isnan(lacks_m)) continue;
    const double rate = ray.dz - (plane.u_slope_m * ray.du + plane.v_slope_m * ray.dv);
    rise_m = rate > 0 ? std::max(rise_m, t_in + lacks_m / rate) : never_m;
  }
  return rise_m;
}

}  // namespace

std::optional<Crossing> LevelSurface::first_crossing(const FacetRay& ray, double t_begin_m,
                                                     double t_end_m) const noexcept {
  Crossing best;
  walk(ray.grid, t_begin_m, t_end_m, cell_extent, [&](const Place& place, double t_in, double) {
    if (t_in > best.range_m) return true;
    if (place.leaf != nullptr) hit_cell(ray, place.cell, *place.leaf, place.level, best);
    return false;
  });
  return std::isinf(best.range_m) ? std::nullopt : std::optional(best);
}

LevelSurface::DecidingCells LevelSurface::deciding_cells(const Leaf& leaf) const noexcept {
  const std::uint32_t number = level_at(leaf.column, leaf.row);
  const LevelView& level = *levels_[number];
  return {number, {level, leaf, level.deciding_exponent(leaf)}};
}

LevelSurface::Escape LevelSurface::escape_surface(const FacetRay& ray,
                                                  double above_m) const noexcept {
  const double end_m = ray.far_m;
  Escape escape;
  Crossing best;
  walk(ray.grid, 0, end_m, cell_extent, [&](const Place& place, double t_in, double t_out) {
    const double rise_m =
        place.leaf == nullptr ? t_in : rises_to(place.cell, ray.grid, above_m, t_in);
    escape.begin_m = std::min(rise_m, t_out);
    if (place.leaf != nullptr) hit_cell(ray, place.cell, *place.leaf, place.level, best);
    if (best.range_m <= escape.begin_m) {
      escape = {best.range_m, best};
      return true;
    }
    return rise_m <= t_out;
  });
  return escape;
}

namespace {

// Returns the t at which a ray passes from one triangle of a cell to the other.
double diagonal_m(const Cell& cell, const GridRay& ray) {
  const double sign = cell.split == Cell::Split::NorthEastToSouthWest ? 1 : -1;
  const double offset = sign > 0 ? 1 : 0;
  const double across = (ray.u0 - cell.column) / cell.width;
  const double down = (ray.v0 - cell.row) / cell.height;
  return (offset - (across + sign * down)) / (ray.du / cell.width + sign * (ray.dv / cell.height));
}

// Follows a ray down through the band round the surface that contains the reference surface.
class BandDescent {
 public:
  BandDescent(const GridRay& ray, LevelSurface::ErrorBand& band) : ray_(ray), band_(band) {}

  // Follows the ray through one cell. Returns whether the band is fully determined.
  bool pass(const Cell& cell, double deviation_m, double t_in, double t_out) {
    const double turn_m = diagonal_m(cell, ray_);
    if (t_in < turn_m && turn_m < t_out)
      return pass_half(cell, deviation_m, t_in, turn_m) ||
             pass_half(cell, deviation_m, turn_m, t_out);
    return pass_half(cell, deviation_m, t_in, t_out);
  }
  void pass_clear() {
    over_surface_ = true;
    is_below_ = false;
  }
  void pass_hole() { over_surface_ = false; }

 private:
  bool pass_half(const Cell& cell, double deviation_m, double t_in, double t_out) {
    const double middle_m = std::isinf(t_out) ? t_in : (t_in + t_out) / 2;
    const FacetPlane plane = plane_at(cell, ray_, middle_m);
    const double in_m = clearance_m(ray_, plane, t_in);
    over_surface_ &= !std::isnan(in_m);
    if (std::isnan(in_m)) return false;
    if (!over_surface_) {
      if (std::abs(in_m) < deviation_m) return give_up();
      is_below_ = in_m < 0;
      over_surface_ = true;
    }
    if (is_below_) {  // until the ray emerges; hits from below are ignored
      is_below_ = out_m(plane, t_out) < 0;
      return deviation_m > 0 && out_m(plane, t_out) > -deviation_m && give_up();
    }
    const double near_m = falls_to(deviation_m, plane, in_m, t_in, t_out);
    band_.near_m = std::min(band_.near_m, near_m);
    band_.far_m = falls_to(-deviation_m, plane, in_m, t_in, t_out);
    return band_.far_m < never_m;
  }
  bool give_up() {
    band_.is_certain = false;
    return true;
  }
  double out_m(const FacetPlane& plane, double t_out) const {
    return std::isinf(t_out) ? ray_.dz * std::numeric_limits<double>::infinity()
                             : clearance_m(ray_, plane, t_out);
  }
  // Returns the t in [t_in, t_out] at which the clearance falls below `level_m`; infinite if it
  // does not.
  double falls_to(double level_m, const FacetPlane& plane, double in_m, double t_in,
                  double t_out) const {
    if (in_m < level_m) return t_in;
    if (!(out_m(plane, t_out) < level_m)) return never_m;
    GridRay lifted = ray_;
    lifted.z0 -= level_m;
    return std::clamp(intersect(lifted, plane), t_in, t_out);
  }

  const GridRay& ray_;
  LevelSurface::ErrorBand& band_;
  bool over_surface_ = false;
  bool is_below_ = false;
};

}  // namespace

LevelSurface::ErrorBand LevelSurface::error_band(const GridRay& ray,
                                                 double t_end_m) const noexcept {
  ErrorBand band;
  BandDescent descent(ray, band);
  const auto leaf_extent_of = [this](const Place& place) { return leaf_extent(place); };
  walk(ray, 0, t_end_m, leaf_extent_of, [&](const Place& place, double t_in, double t_out) {
    if (place.leaf == nullptr) {
      descent.pass_hole();
      return false;
    }
    const Leaf& leaf = *place.leaf;
    const double low_m = std::min(ray.z0 + t_in * ray.dz, ray.z0 + t_out * ray.dz);
    if (low_m > leaf.high_m + leaf.deviation_m) {
      if (leaf.has_holes) {
        descent.pass_hole();
      } else {
        descent.pass_clear();
      }
      return false;
    }
    if (leaf.bridges()) {
      band.is_certain = false;
      return true;
    }
    bool done = false;
    walk(ray, t_in, t_out, cell_extent, [&](const Place& cell, double from_m, double to_m) {
      done = descent.pass(cell.cell, leaf.deviation_m, from_m, to_m);
      return done;
    });
    return done;
  });
  return band;
}

}  // namespace groundray
