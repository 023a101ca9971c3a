#include "terrain/scatter/scatter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <numbers>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "terrain/scatter/dart_field.h"

namespace groundray {
namespace {

using std::numbers::pi;

constexpr int tile_cells = 32;
constexpr int tile_margin = 2;     // cells around a tile that are probably needed as well
constexpr int max_cell = 1 << 28;  // cell numbers range from minus this to this
constexpr double max_darts_in_all = 1e9;

double radians(double angle_deg) { return angle_deg * pi / 180; }

bool is_finite_range(const Interval& range) { return std::isfinite(range.low + range.high); }

double share_in(const Interval& range, double share) {
  return std::min(range.low + (range.high - range.low) * share, range.high);
}

void check_scatter(const ScatterSpec& spec) {
  Violations broken("ScatterSpec");
  broken.unless(spec.min_distance_m >= 0 && std::isfinite(spec.min_distance_m),
                "min_distance_m = {} must be 0 or more, and finite", spec.min_distance_m);
  const auto in_order = [&](const char* name, const Interval& range) {
    broken.unless(range.low <= range.high, "{} = [{}, {}] is empty: are its ends swapped?", name,
                  range.low, range.high);
  };
  in_order("slope_deg", spec.slope_deg);
  in_order("height_m", spec.height_m);
  in_order("scale", spec.scale);
  in_order("yaw_deg", spec.yaw_deg);
  broken.unless(spec.slope_deg.high >= 0 && spec.slope_deg.low <= 90,
                "slope_deg = [{}, {}] excludes all slopes from 0 to 90", spec.slope_deg.low,
                spec.slope_deg.high);
  broken.unless(spec.scale.low > 0 && is_finite_range(spec.scale),
                "scale = [{}, {}] must be positive and finite", spec.scale.low, spec.scale.high);
  if (spec.scales) {
    const auto& [shape, scale] = *spec.scales;
    broken.unless(shape > 0 && scale > 0 && std::isfinite(shape + scale),
                  "scales = {{shape {}, scale {}}} must be positive and finite", shape, scale);
  }
  broken.unless(is_finite_range(spec.yaw_deg), "yaw_deg = [{}, {}] must be finite",
                spec.yaw_deg.low, spec.yaw_deg.high);
  broken.unless(std::isfinite(spec.sink_m), "sink_m = {} must be finite", spec.sink_m);
  const double weight = std::accumulate(spec.weights.begin(), spec.weights.end(), 0.0);
  broken.unless(weight > 0 && std::isfinite(weight) &&
                    std::ranges::all_of(spec.weights, [](double w) { return w >= 0; }),
                "weights must be finite and 0 or more, at least one of them positive");
  broken.unless(std::isfinite(spec.origin_w_m.x + spec.origin_w_m.y),
                "origin_w_m = ({}, {}) must be finite", spec.origin_w_m.x, spec.origin_w_m.y);
  if (spec.rows) {
    const Rows& rows = *spec.rows;
    broken.unless(
        rows.between_m > 0 && rows.within_m > 0 && std::isfinite(rows.between_m + rows.within_m),
        "rows: spacing_m = [{}, {}] must be positive and finite", rows.between_m, rows.within_m);
    broken.unless(std::isfinite(rows.azimuth_deg), "rows: azimuth_deg = {} must be finite",
                  rows.azimuth_deg);
    broken.unless(
        rows.jitter_m >= 0 && rows.jitter_m <= std::min(rows.between_m, rows.within_m) / 2,
        "rows: jitter_m = {} must be from 0 to half of the smaller spacing", rows.jitter_m);
    broken.unless(spec.min_distance_m == 0,
                  "min_distance_m = {} has no meaning in rows, whose spacing_m is the distance; "
                  "remove one of them",
                  spec.min_distance_m);
  }
  if (spec.clusters) {
    const auto& [size_m, contrast] = *spec.clusters;
    broken.unless(size_m > 0 && std::isfinite(size_m),
                  "clusters: size_m = {} must be positive and finite", size_m);
    broken.unless(contrast >= 0 && contrast <= 1, "clusters: contrast = {} must be from 0 to 1",
                  contrast);
    broken.unless(!spec.rows,
                  "clusters have no meaning in rows, whose sites are given; remove one of them, or "
                  "make gaps with a density map");
  }
  broken.throw_if_any();
}

// Returns the density of darts of which `per_m2` are accepted.
// @param where  of that density, for the message.
double darts_per_m2(double per_m2, double min_distance_m, std::string_view where) {
  const double disc_m2 = pi / 4 * min_distance_m * min_distance_m;
  const double coverage = per_m2 * disc_m2;
  if (coverage > max_adsorption_coverage) {
    throw Error(
        "a density of {} plants per m2{} is too high for min_distance_m = {}: that distance "
        "permits "
        "at most {:.5g} per m2, that density at most {:.5g} m",
        per_m2, where, min_distance_m, max_adsorption_coverage / disc_m2,
        std::sqrt(max_adsorption_coverage / (pi / 4 * per_m2)));
  }
  return coverage > 0 ? thrown_for(coverage) / disc_m2 : per_m2;
}

// Returns the side of a lattice's cells. The minimum distance reaches no farther than the next
// cell, and cells have 2 to 8 darts if the distance permits. Sides that follow from the latter are
// powers of two, so that a slightly higher density keeps the lattice.
double cell_side_m(double darts_per_m2, double min_distance_m) {
  return std::max(min_distance_m, math::exp2(std::floor(math::log2(8 / darts_per_m2) / 2)));
}

std::uint64_t placement_key(glm::ivec2 cell, std::uint32_t number) {
  const auto bits = [](std::int64_t index) { return static_cast<std::uint64_t>(index + max_cell); };
  return bits(cell.y) << 35 | bits(cell.x) << 6 | number;
}

[[noreturn]] void refuse(double plants, double max_per_m2) {
  throw Error(
      "{:.4g} plants exceed the limit of {} in memory at once; lower the density, now up to {} per "
      "m2, narrow the limits, or request a smaller area",
      plants, Scatter::max_placements, max_per_m2);
}

}  // namespace

Area area_of(const GridFrame& frame) {
  const glm::dvec2 a = frame.to_D({0, 0});
  const glm::dvec2 b = frame.to_D(frame.samples - 1);
  return {glm::min(a, b), glm::max(a, b)};
}

glm::dquat tilt_to(const glm::dvec3& normal) {
  return glm::normalize(glm::dquat(1 + normal.z, -normal.y, normal.x, 0));
}

double Weibull::quantile(double share, const Interval& interval) const {
  const double most = -math::expm1(-math::pow((interval.high - interval.low) / scale, shape));
  const double value = interval.low + scale * math::pow(-math::log1p(-share * most), 1 / shape);
  return std::clamp(value, interval.low, interval.high);
}

struct Scatter::Impl {
  Impl(Ground where, DensityMap wish, const ScatterSpec& wishes, Seed seed);

  glm::ivec2 cell_at(glm::dvec2 p) const {
    return glm::ivec2(glm::floor((p + origin_in_cell_m) / lattice.side_m) + origin_cell);
  }
  glm::dvec2 place(const Dart& dart) const {
    return (glm::dvec2(dart.cell) - origin_cell + dart.at) * lattice.side_m - origin_in_cell_m;
  }
  // Returns the cells that may have darts in an area: one more on each side, because positions are
  // rounded.
  std::pair<glm::ivec2, glm::ivec2> cells_of(const Area& within) const {
    return {cell_at(within.low_m) - 1, cell_at(within.high_m) + 2};
  }
  // Position of a plant on the ground, and the ground's normal there.
  struct Footing {
    glm::dvec3 point, normal;
  };
  // Returns nothing where a hole or a limit excludes plants.
  std::optional<Footing> footing_at(glm::dvec2 p) const;
  // Returns the plants of a tile of cells.
  std::vector<Placement> tile(glm::ivec2 first, const Area& within) const;
  // Returns the plants of a row.
  std::vector<Placement> row(int number, const Area& within) const;
  Placement placed(glm::ivec2 cell, std::uint32_t number, const Footing& footing) const;
  // Returns the density at a position on the ground, without clearings.
  double per_m2_at(glm::dvec2 p) const {
    return density.per_m2_at(p) * (spec.suitability ? spec.suitability(p) : 1);
  }
  void refuse_too_many(const Area& within) const;

  Ground ground;
  DensityMap density;
  ScatterSpec spec;
  ClearedGround cleared;
  DartLattice lattice;
  std::optional<RowLattice> rows;
  std::optional<ClusterField> clusters;
  double highest_per_m2 = 0;         // of density and clusters
  Area area;                         // where both ground and density are defined
  glm::dvec2 origin_cell{0};         // cell of D's origin, whole numbers
  glm::dvec2 origin_in_cell_m{0};    // position of D's origin in that cell
  std::vector<double> shares_up_to;  // cumulative weights of the prototypes
};

Scatter::Impl::Impl(Ground where, DensityMap wish, const ScatterSpec& wishes, Seed seed)
    : ground(std::move(where)),
      density(std::move(wish)),
      spec(wishes),
      cleared(spec.clearings),
      area(area_of(ground.frame()) & density.area()) {
  check_scatter(spec);
  if (area.is_empty()) {
    const Area all = area_of(ground.frame());
    const Area map = density.area();
    throw Error(
        "the density map, x {} to {} and y {} to {} m in D, does not overlap the ground, x {} to "
        "{} and y {} to {}; do both have the correct CRS?",
        map.low_m.x, map.high_m.x, map.low_m.y, map.high_m.y, all.low_m.x, all.high_m.x,
        all.low_m.y, all.high_m.y);
  }
  std::partial_sum(spec.weights.begin(), spec.weights.end(), std::back_inserter(shares_up_to));
  for (double& share : shares_up_to) share /= shares_up_to.back();
  highest_per_m2 = density.max_per_m2();
  if (highest_per_m2 == 0) return;
  if (spec.rows) {
    lattice = {.seed = seed, .layer = spec.layer};
    lattice.per_m2 = 1 / (spec.rows->between_m * spec.rows->within_m);
    rows.emplace(*spec.rows, spec.origin_w_m);
    if (density.max_per_m2() > lattice.per_m2 * (1 + 1e-9)) {
      throw Error(
          "a density of {} plants per m2 is more than rows with sites {} x {} m apart have, {:.5g} "
          "per m2",
          density.max_per_m2(), spec.rows->between_m, spec.rows->within_m, lattice.per_m2);
    }
    return;
  }
  if (spec.clusters && spec.clusters->contrast > 0) {
    clusters.emplace(*spec.clusters, seed, spec.layer);
    highest_per_m2 *= clusters->highest();
  }
  const double darts =
      darts_per_m2(highest_per_m2, spec.min_distance_m, clusters ? ", in clusters," : "");
  const double side_m = cell_side_m(darts, spec.min_distance_m);
  lattice = {seed, spec.layer, side_m, darts, spec.min_distance_m};
  origin_cell = glm::floor(spec.origin_w_m / side_m);
  origin_in_cell_m = spec.origin_w_m - origin_cell * side_m;
  const glm::dvec2 farthest =
      glm::max(glm::abs(spec.origin_w_m + area.low_m), glm::abs(spec.origin_w_m + area.high_m));
  if (!(std::max(farthest.x, farthest.y) / side_m < max_cell - tile_cells - 3)) {
    throw Error(
        "{} plants per m2 require cells of {} m, whose indices overflow at ({}, {}) m from W's "
        "origin; lower the density",
        highest_per_m2, side_m, farthest.x, farthest.y);
  }
  if (clusters && !(std::max(farthest.x, farthest.y) / spec.clusters->size_m < max_cell)) {
    throw Error(
        "clusters: cells of size_m = {} have indices that overflow at ({}, {}) m from W's origin; "
        "make them larger",
        spec.clusters->size_m, farthest.x, farthest.y);
  }
}

std::optional<Scatter::Impl::Footing> Scatter::Impl::footing_at(glm::dvec2 p) const {
  const auto facet = ground.facet_at(p);
  if (!facet) return std::nullopt;
  const glm::dvec2 at = ground.frame().to_grid(p);
  const double height_m = facet->height_m + facet->u_slope_m * at.x + facet->v_slope_m * at.y;
  const glm::dvec3 normal = ground.frame().normal(*facet);
  const double slope_rad = math::atan2(glm::length(glm::dvec2(normal)), normal.z);
  if (!spec.height_m.contains(height_m) || !spec.slope_deg.contains(slope_rad * 180 / pi)) {
    return std::nullopt;
  }
  return Footing{{p, height_m}, normal};
}

Placement Scatter::Impl::placed(glm::ivec2 cell, std::uint32_t number,
                                const Footing& footing) const {
  const glm::dvec4 u = draw(lattice, cell, number, DartDraw::Plant);
  const double half_yaw_rad = radians(share_in(spec.yaw_deg, u.y)) / 2;
  Placement placement;
  placement.scale =
      spec.scales ? spec.scales->quantile(u.x, spec.scale) : share_in(spec.scale, u.x);
  placement.p_DO = footing.point - glm::dvec3(0, 0, spec.sink_m * placement.scale);
  placement.R_DO = {math::cos(half_yaw_rad), 0, 0, math::sin(half_yaw_rad)};
  if (spec.stance == Stance::OnSlope) placement.R_DO = tilt_to(footing.normal) * placement.R_DO;
  // The first one whose cumulative weight exceeds u.z: never one of weight 0.
  placement.prototype = static_cast<std::uint32_t>(std::ranges::upper_bound(shares_up_to, u.z) -
                                                   shares_up_to.begin());
  placement.key = placement_key(cell, number);
  return placement;
}

std::vector<Placement> Scatter::Impl::tile(glm::ivec2 first, const Area& within) const {
  std::vector<Placement> found;
  // Positions are rounded, hence the margin.
  const auto box = [&](glm::ivec2 cell, int cells) -> Area {
    const glm::dvec2 low = place({.cell = cell});
    return {low - 1e-6 * lattice.side_m, low + (cells + 1e-6) * lattice.side_m};
  };
  const Area all = box(first, tile_cells);
  if (density.is_empty(all)) return found;  // as in most of a sparse map
  DartField darts(lattice, first - tile_margin, glm::ivec2(tile_cells + 2 * tile_margin));
  const ClearedGround clearings = cleared.near(all);
  for (int i = 0; i < tile_cells * tile_cells; ++i) {
    const glm::ivec2 cell = first + glm::ivec2(i % tile_cells, i / tile_cells);
    if (density.is_empty(box(cell, 1))) continue;
    const auto [begin, end] = darts.in_cell(cell);
    for (std::size_t k = begin; k < end; ++k) {
      const Dart dart = darts.dart(k);  // a copy: evaluating other darts may move it
      const glm::dvec2 p = place(dart);
      double wanted = per_m2_at(p) / highest_per_m2;
      // From the lattice's own coordinates, so that it does not depend on D's origin.
      if (clusters) wanted *= clusters->at((glm::dvec2(dart.cell) + dart.at) * lattice.side_m);
      if (!within.contains(p) || !(dart.chance < wanted) || clearings.contains(p)) continue;
      const auto footing = footing_at(p);
      if (footing && darts.stands(k)) found.push_back(placed(dart.cell, dart.number, *footing));
    }
  }
  return found;
}

std::vector<Placement> Scatter::Impl::row(int number, const Area& within) const {
  std::vector<Placement> found;
  const RowLattice::Range sites = rows->sites_of(within);
  for (int i = sites.first.x; i < sites.end.x; ++i) {
    const glm::ivec2 site(i, number);
    const glm::dvec4 u = draw(lattice, site, 0, DartDraw::Dart);
    const glm::dvec2 p =
        rows->site(site) + spec.rows->jitter_m * (2.0 * glm::dvec2(u.x, u.y) - 1.0);
    if (!within.contains(p) || !(u.z < per_m2_at(p) / lattice.per_m2)) continue;
    if (cleared.contains(p)) continue;
    if (const auto footing = footing_at(p)) found.push_back(placed(site, 0, *footing));
  }
  return found;
}

// Rejects a mistaken density that would exhaust the memory or take hours. Its counts are estimates.
void Scatter::Impl::refuse_too_many(const Area& within) const {
  const glm::dvec2 size_m = within.high_m - within.low_m;
  const double all_m2 = size_m.x * size_m.y;
  // Skipping a cell without density takes a tenth of the time.
  const double grown_m2 = std::max(std::min(all_m2, density.grown_m2()), all_m2 / 10);
  if (lattice.per_m2 * grown_m2 > max_darts_in_all) {
    throw Error(
        "a density of up to {} plants per m2 on {:.3g} m2 requires {:.2g} candidate positions, "
        "more than {:.0g}; request a smaller area, lower the density, or move peaks of the map to "
        "a separate layer",
        highest_per_m2, grown_m2, lattice.per_m2 * grown_m2, max_darts_in_all);
  }
  if (density.max_per_m2() * all_m2 <= max_placements) return;
  constexpr int steps = 256;
  double expected = 0;
  for (int i = 0; i < steps * steps; ++i) {
    const glm::dvec2 p = within.low_m + (glm::dvec2(i % steps, i / steps) + 0.5) * size_m / 256.0;
    double per_m2 = per_m2_at(p);
    if (clusters) per_m2 *= clusters->at(p + spec.origin_w_m);
    if (per_m2 > 0 && !cleared.contains(p) && footing_at(p)) expected += per_m2;
  }
  expected *= all_m2 / (steps * steps);
  if (expected > 2.0 * max_placements) refuse(expected, density.max_per_m2());
}

Scatter::Scatter(Ground ground, DensityMap density, const ScatterSpec& spec, Seed seed)
    : impl_(std::make_shared<Impl>(std::move(ground), std::move(density), spec, seed)) {}

std::vector<Placement> Scatter::placements(const Area& area, const PassRunner& runner) const {
  const Area within = area & impl_->area;
  if (within.is_empty() || impl_->density.max_per_m2() == 0) return {};
  impl_->refuse_too_many(within);
  // Parts of the plane that are searched one by one: rows, or tiles of cells.
  std::function<std::vector<Placement>(std::size_t)> part;
  std::size_t parts = 0;
  if (impl_->rows) {
    const RowLattice::Range sites = impl_->rows->sites_of(within);
    parts = static_cast<std::size_t>(sites.end.y - sites.first.y);
    part = [&, first = sites.first.y](std::size_t index) {
      return impl_->row(first + static_cast<int>(index), within);
    };
  } else {
    const auto [first, end] = impl_->cells_of(within);
    const glm::ivec2 tiles = (end - first + tile_cells - 1) / tile_cells;
    parts = static_cast<std::size_t>(tiles.x) * static_cast<std::size_t>(tiles.y);
    part = [&, first = first, tiles](std::size_t index) {
      const glm::ivec2 tile(index % static_cast<std::size_t>(tiles.x),
                            index / static_cast<std::size_t>(tiles.x));
      return impl_->tile(first + tile * tile_cells, within);
    };
  }
  std::vector<std::vector<Placement>> found(parts);
  std::atomic<std::size_t> count = 0;
  run_pass(runner, found.size(), [&](std::size_t index) {
    std::vector<Placement> some = part(index);
    // Beyond the limit, plants are only counted, for the message.
    const std::size_t so_far = count += some.size();
    if (so_far <= max_placements) found[index] = std::move(some);
  });
  if (count > max_placements) {
    refuse(static_cast<double>(count), impl_->density.max_per_m2());
  }
  std::vector<Placement> all;
  all.reserve(count);
  for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
  std::ranges::sort(all, {}, &Placement::key);
  return all;
}

}  // namespace groundray
