#include "reconstruction/dem/fusion/tile_fit.h"

#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>

#include "core/math.h"
#include "reconstruction/dem/fusion/cell_fit.h"
#include "reconstruction/dem/fusion/float_lanes.h"
#include "reconstruction/dem/fusion/neighbour_surface.h"

namespace groundray {
namespace {

constexpr int margin = CellTiling::margin;
constexpr int width = CellTiling::width;

// Distance of cells from which the roughness of the ground is estimated: their neighbours are in
// the margin, too.
constexpr int rough_reach = 1;
static_assert(rough_reach + 2 <= margin);

// Sorts the points of a cell by height, and those of equal height by their other members.
class CellSort {
 public:
  void operator()(std::span<PackedPoint> cell) {
    if (cell.size() < 2) return;
    points_.assign(cell.begin(), cell.end());
    cell.size() <= few_numbers ? place_few(cell) : place_many(cell);
    for (std::size_t from = 0, to = 1; to <= cell.size(); ++to) {
      if (to < cell.size() && cell[to].height == cell[from].height) continue;
      if (to - from > 1) std::sort(&cell[from], &cell[from] + (to - from));
      from = to;
    }
  }

 private:
  // Places each point after those that are lower, or as low and earlier.
  void place_few(std::span<PackedPoint> cell) {
    std::array<std::int32_t, few_numbers> heights{}, lower;
    std::array<std::uint8_t, few_numbers> taken{};
    for (std::size_t i = 0; i < cell.size(); ++i) heights[i] = cell[i].height;
    count_below_each(heights.data(), cell.size(), lower.data());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto at = static_cast<std::size_t>(lower[i]);
      cell[at + taken[at]++] = points_[i];
    }
  }
  void place_many(std::span<PackedPoint> cell) {
    constexpr std::uint32_t sign = 0x80000000U;
    keys_.resize(cell.size());
    for (std::size_t i = 0; i < cell.size(); ++i) {
      const std::uint32_t height = static_cast<std::uint32_t>(cell[i].height) ^ sign;
      keys_[i] = std::uint64_t{height} << 32U | i;
    }
    std::sort(keys_.begin(), keys_.end());
    for (std::size_t i = 0; i < cell.size(); ++i) cell[i] = points_[keys_[i] & 0xFFFFFFFFU];
  }

  std::vector<std::uint64_t> keys_;
  std::vector<PackedPoint> points_;
};

// Points of a tile by cell, ascending in each, and the first guess of each cell.
class TilePoints {
 public:
  TilePoints(const PointParts& parts, glm::ivec2 size, const TileRules& rules);

  std::span<const PackedPoint> cell(int column, int row) const noexcept {
    const std::size_t at = index(column, row);
    return {points_.get() + begins_[at], begins_[at + 1] - begins_[at]};
  }
  const GroundGuess* guess(int column, int row) const noexcept {
    return &guesses_[index(column, row)];
  }
  NeighbourSurface neighbours(int column, int row) const noexcept {
    return neighbour_surface(guess(column, row), width, rules_.step_m, rules_.slope_sd,
                             sketches_[index(column, row)], scatter(column, row));
  }

 private:
  static std::size_t index(int column, int row) noexcept {
    return static_cast<std::size_t>(row + margin) * width +
           static_cast<std::size_t>(column + margin);
  }
  GroundScatter scatter(int column, int row) const noexcept;
  void look_at(std::size_t cell, CellSort& sort, std::vector<CellSurface>& surfaces);

  const TileRules& rules_;
  double tallest_m_;
  std::unique_ptr<PackedPoint[]> points_;
  std::vector<std::uint32_t> begins_;
  std::vector<GroundGuess> guesses_;
  std::vector<NeighbourSketch> sketches_;
};

std::size_t count_of(const PointParts& parts) {
  std::size_t count = 0;
  for (const std::span<const PackedPoint> part : parts) count += part.size();
  return count;
}

double tallest_ground_m(const TileRules& rules) {
  return rules.steepest_slope * math::hypot(rules.step_m.x, rules.step_m.y);
}

TilePoints::TilePoints(const PointParts& parts, glm::ivec2 size, const TileRules& rules)
    : rules_(rules),
      tallest_m_(tallest_ground_m(rules)),
      points_(std::make_unique_for_overwrite<PackedPoint[]>(count_of(parts))) {
  const std::size_t cells = static_cast<std::size_t>(size.y + 2 * margin) * width;
  begins_.assign(cells + 2, 0);
  for (const std::span<const PackedPoint> part : parts)
    for (const PackedPoint& point : part) ++begins_[point.cell + std::size_t{2}];
  for (std::size_t i = 2; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  for (const std::span<const PackedPoint> part : parts)
    for (const PackedPoint& point : part) points_[begins_[point.cell + std::size_t{1}]++] = point;
  guesses_.resize(cells);
  tbb::parallel_for(0, size.y + 2 * margin, [&](int row) {
    CellSort sort;
    std::vector<CellSurface> surfaces;
    for (int column = 0; column < size.x + 2 * margin; ++column)
      look_at(index(column - margin, row - margin), sort, surfaces);
  });
  sketches_.resize(cells);
  tbb::parallel_for(-rough_reach, size.y + rough_reach, [&](int row) {
    for (int column = -rough_reach; column < size.x + rough_reach; ++column) {
      sketches_[index(column, row)] =
          sketch_neighbours(guess(column, row), width, rules_.step_m, rules_.slope_sd);
    }
  });
}

// Returns the scatter of the ground in 7 x 7 cells: the mean of that about 9 surfaces. If these
// have few degrees of freedom, it is complemented by the scatter about planes and by an expected
// value. It also allows for scatter that noise hides: a variance is never negative, so the mean of
// its possible values is that of a normal distribution truncated at 0, which this root equals at 0
// and far above.
GroundScatter TilePoints::scatter(int column, int row) const noexcept {
  constexpr double plane_counts = 3, expected_counts = 1, expected_bend = 0.02;
  constexpr double overlap = 4;   // the 7 x 7 cells have a fourth of the freedom of the 9 sums
  constexpr double at_0 = 0.798;  // that mean at 0, in sd: sqrt(2 / pi)
  double rough = 0, spread = 0, freedom = 0, plane = 0, cells = 0;
  for (int r = row - rough_reach; r <= row + rough_reach; ++r) {
    for (int c = column - rough_reach; c <= column + rough_reach; ++c) {
      const NeighbourSketch& one = sketches_[index(c, r)];
      const double more = one.plane_counts;
      rough += double{one.freedom} * double{one.rough_m2};
      spread += double{one.freedom} * double{one.freedom} * double{one.rough_m4};
      freedom += double{one.freedom};
      plane += more * double{one.plane_m2};
      cells += more;
    }
  }
  const double bend = expected_bend * rules_.slope_sd;
  const double expected_m2 = std::abs(rules_.step_m.x * rules_.step_m.y) * bend * bend;
  const double all = freedom + plane_counts + expected_counts;
  plane = (plane + expected_counts * expected_m2) / (cells + expected_counts);
  const double half_m2 = 0.5 * (rough + plane_counts * plane + expected_counts * expected_m2) / all;
  const double hidden_m4 = at_0 * at_0 * overlap * spread / (all * all);
  return {plane, half_m2 + std::sqrt(half_m2 * half_m2 + hidden_m4)};
}

// Returns the guess from the lowest surface that outliers do not explain: the mean of the middle
// half of its points, which for a plane lies on the plane.
GroundGuess first_guess(std::span<const PackedPoint> cell, const CellSurface& ground,
                        glm::dvec2 step_m) {
  const std::uint32_t quarter = ground.size() / 4, half = ground.size() - 2 * quarter;
  double noise_m2 = 0, bias_m2 = 0, across_m2 = 0, x = 0, y = 0, height = 0;
  double lean_x = 0, lean_y = 0;
  for (const PackedPoint& p : cell.subspan(ground.begin + quarter, half)) {
    const double sd = unpacked_sd(p.sd), bias = unpacked_sd(p.bias);
    const double across = unpacked_sd(p.across);
    across_m2 += across * across;
    noise_m2 += sd * sd;
    bias_m2 += bias * bias;
    lean_x += double{unpacked_lean(p.lean_x)};
    lean_y += double{unpacked_lean(p.lean_y)};
    x += double{PackedPoint::from_sample(p.x)};
    y += double{PackedPoint::from_sample(p.y)};
    height += p.height;
  }
  const std::uint32_t group = cell[ground.begin + quarter].group;
  const bool is_one = std::all_of(cell.begin() + ground.begin + quarter,
                                  cell.begin() + ground.begin + quarter + half,
                                  [group](const PackedPoint& p) { return p.group == group; });
  // For normal errors, the mean of the middle half has 1.2 times the variance of the mean of all.
  const double more = quarter == 0 ? 1 : 1.2;
  const double n = half, shared_m2 = (more * noise_m2 / n + bias_m2 / n) / ground.size();
  return {height / n * PackedPoint::height_step_m,
          static_cast<float>(shared_m2 + 1e-8),
          static_cast<float>(more * across_m2 / n / ground.size()),
          static_cast<float>(lean_x / n),
          static_cast<float>(lean_y / n),
          static_cast<float>(std::sqrt(bias_m2 / n)),
          is_one ? group : no_group,
          static_cast<float>(x / n * step_m.x),
          static_cast<float>(y / n * step_m.y)};
}

void TilePoints::look_at(std::size_t cell, CellSort& sort, std::vector<CellSurface>& surfaces) {
  const std::span<PackedPoint> points(points_.get() + begins_[cell],
                                      begins_[cell + 1] - begins_[cell]);
  if (points.empty()) return;
  sort(points);
  find_surfaces(points, rules_.gap_m, surfaces);
  const std::uint32_t credible =
      rules_.outliers.credible(static_cast<std::uint32_t>(points.size()));
  for (const CellSurface& surface : surfaces) {
    if (surface.size() < credible) continue;
    guesses_[cell] =
        first_guess(points, lower_part(points, surface, credible, tallest_m_), rules_.step_m);
    return;
  }
}

// Fit of one row of cells.
class RowFit {
 public:
  RowFit(const TilePoints& points, const TileRules& rules)
      : points_(points),
        rules_(rules),
        tallest_m_(tallest_ground_m(rules)),
        cell_fit_(rules.outliers.share()) {}

  void fit_cell(int column, int row, std::size_t at, DemLayers& layers);
  const TileCounts& counts() const noexcept { return counts_; }

 private:
  std::optional<CellSurface> ground(std::size_t at, DemLayers& layers);
  bool is_credible(const CellSurface& surface) const;
  bool agrees(double low_m, double high_m, double variance_m2, double give_m) const;
  bool stands_clear(const CellSurface& wall) const;
  double top_of_ground() const;
  CellSurface foot(const CellSurface& wall) const;
  static void set_overhang(std::size_t at, double overhang_m, double top_m, DemLayers& layers);
  void set_ground(std::size_t at, const CellHeight& ground, double reference_m,
                  DemLayers& layers) const;

  const TilePoints& points_;
  const TileRules& rules_;
  double tallest_m_;
  CellFit cell_fit_;
  std::vector<CellSurface> surfaces_;
  std::span<const PackedPoint> cell_;
  NeighbourSurface around_;
  TileCounts counts_;
};

// Returns whether the neighbours' ground passes between these heights, within `give_m` and three
// standard deviations.
bool RowFit::agrees(double low_m, double high_m, double variance_m2, double give_m) const {
  give_m += 3 * std::sqrt(variance_m2 + around_.height_variance_m2);
  return low_m - give_m <= around_.plane.height_m && around_.plane.height_m <= high_m + give_m;
}

// Returns whether neighbours show that the foot of a wall or trunk is hidden.
bool RowFit::stands_clear(const CellSurface& wall) const {
  const double low_m = cell_[wall.begin].height_m();
  return around_.cells >= enough_neighbours && low_m > around_.plane.height_m &&
         !agrees(low_m, low_m, 0, rules_.gap_m);
}

// Returns the lower part of a wall or trunk without the points above the neighbours' ground, if
// there are points below.
CellSurface RowFit::foot(const CellSurface& wall) const {
  constexpr std::uint32_t enough = 3;
  if (around_.cells < enough_neighbours) return wall;
  const double highest_m = around_.plane.height_m + 3 * std::sqrt(around_.height_variance_m2) +
                           3 * total_sd_m(cell_[wall.begin]);
  CellSurface foot = wall;
  while (foot.size() > enough && cell_[foot.end - 1].height_m() > highest_m) --foot.end;
  return cell_[foot.end - 1].height_m() > highest_m ? wall : foot;
}

// Few points are credible if neighbours determine the height of the ground and agree with it. Three
// or more that outliers do not explain are credible unless neighbours that agree with each other
// contradict; more than that in any case.
bool RowFit::is_credible(const CellSurface& surface) const {
  const std::uint32_t size = surface.size();
  const std::uint32_t credible = rules_.outliers.credible(static_cast<std::uint32_t>(cell_.size()));
  if (rules_.outliers.none() || (size >= 3 && size > credible)) return true;
  const bool is_enough = size >= 3 && size >= credible;
  if (around_.cells < enough_neighbours) return is_enough;
  const bool is_known = is_enough ? around_.scatter_m <= 0.5 * tallest_m_
                                  : std::sqrt(around_.height_variance_m2) <= rules_.gap_m / 3;
  if (!is_known) return is_enough;
  const double sd_m = total_sd_m(cell_[surface.begin]);
  return agrees(cell_[surface.begin].height_m(), cell_[surface.end - 1].height_m(), sd_m * sd_m,
                is_enough ? rules_.gap_m : 0);
}

// Returns the greatest height of the neighbours' ground within this cell.
double RowFit::top_of_ground() const {
  const SurfacePlane& plane = around_.plane;
  return plane.height_m + 0.5 * (std::abs(plane.slope_x) * rules_.step_m.x +
                                 std::abs(plane.slope_y) * rules_.step_m.y);
}

void RowFit::set_overhang(std::size_t at, double overhang_m, double top_m, DemLayers& layers) {
  layers.overhang_m[at] = static_cast<float>(overhang_m);
  layers.clearance_m[at] = static_cast<float>(overhang_m - top_m);
}

// Returns the points of the ground, if there are any.
std::optional<CellSurface> RowFit::ground(std::size_t at, DemLayers& layers) {
  find_surfaces(cell_, rules_.gap_m, surfaces_);
  std::erase_if(surfaces_, [this](const CellSurface& s) { return !is_credible(s); });
  constexpr std::size_t most = std::numeric_limits<std::uint16_t>::max();
  layers.surfaces[at] = static_cast<std::uint16_t>(std::min(surfaces_.size(), most));
  if (surfaces_.empty()) return std::nullopt;

  const CellSurface& lowest = surfaces_.front();
  CellSurface ground =
      lower_part(cell_, lowest, rules_.outliers.credible(static_cast<std::uint32_t>(cell_.size())),
                 tallest_m_);
  if (ground.end < lowest.end) {
    if (stands_clear(lowest)) {
      set_overhang(at, cell_[lowest.begin].height_m(), top_of_ground(), layers);
      return std::nullopt;
    }
    ground = foot(ground);
  }
  if (surfaces_.size() > 1) {
    set_overhang(at, cell_[surfaces_[1].begin].height_m(), cell_[lowest.end - 1].height_m(),
                 layers);
  }
  return ground;
}

void RowFit::fit_cell(int column, int row, std::size_t at, DemLayers& layers) {
  cell_ = points_.cell(column, row);
  if (cell_.empty()) return;
  around_ = points_.neighbours(column, row);
  const std::optional<CellSurface> points = ground(at, layers);
  if (!points) {
    ++counts_.without_ground;
    return;
  }
  const std::int32_t reference = cell_[points->begin + points->size() / 2].height;
  const std::optional<CellHeight> found =
      cell_fit_(cell_.subspan(points->begin, points->size()), around_, rules_.step_m, reference);
  if (!found) {
    layers.surfaces[at] = static_cast<std::uint16_t>(layers.surfaces[at] - 1);
    // All points of the lowest surface were outliers.
    const double base_m = around_.cells > 0 ? double{layers.overhang_m[at]}
                                            : std::numeric_limits<double>::quiet_NaN();
    set_overhang(at, base_m, top_of_ground(), layers);
    ++counts_.without_ground;
  } else if (!(found->variance_m2 <= rules_.most_sd_m * rules_.most_sd_m)) {
    ++counts_.uncertain;
  } else {
    set_ground(at, *found, reference * PackedPoint::height_step_m, layers);
  }
}

void RowFit::set_ground(std::size_t at, const CellHeight& ground, double reference_m,
                        DemLayers& layers) const {
  layers.elevation_m[at] = static_cast<float>(reference_m + ground.plane.height_m);
  layers.variance_m2[at] = static_cast<float>(ground.variance_m2);
  layers.chi2[at] = static_cast<float>(ground.chi2);
  layers.lidar[at] = ground.lidar;
  layers.stereo[at] = ground.stereo;
  layers.source[at] = ground.stereo == 0  ? HeightSource::Lidar
                      : ground.lidar == 0 ? HeightSource::Stereo
                                          : HeightSource::Fused;
  layers.to_data_m[at] = 0;
  layers.slope_rad[at] =
      static_cast<float>(math::atan(math::hypot(ground.plane.slope_x, ground.plane.slope_y)));
}

}  // namespace

TileCounts fit_tile(const PointParts& parts, glm::ivec2 size, glm::ivec2 first,
                    const TileRules& rules, DemLayers& layers) {
  const TilePoints sorted(parts, size, rules);
  std::atomic<std::uint64_t> without_ground = 0, uncertain = 0;
  tbb::parallel_for(0, size.y, [&](int row) {
    RowFit fit(sorted, rules);
    const auto begin =
        static_cast<std::size_t>(first.y + row) * static_cast<std::size_t>(layers.frame.samples.x) +
        static_cast<std::size_t>(first.x);
    for (int column = 0; column < size.x; ++column)
      fit.fit_cell(column, row, begin + static_cast<std::size_t>(column), layers);
    without_ground += fit.counts().without_ground;
    uncertain += fit.counts().uncertain;
  });
  return {without_ground, uncertain};
}

}  // namespace groundray
