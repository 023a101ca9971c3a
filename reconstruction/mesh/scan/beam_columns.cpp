#include "reconstruction/mesh/scan/beam_columns.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "reconstruction/mesh/scan/firing_lattice.h"

namespace groundray {
namespace {

constexpr double least_slope_rad = 1e-6;  // per column; below, azimuth counts as constant
constexpr std::int64_t narrow = 3;        // empty columns tolerated, for late pulses
constexpr double most_cells_each = 64;    // cells per return, at most

/// Numbers of pulses, and their order within each ring.
struct Numbered {
  std::vector<std::int64_t> number;
  std::int64_t first, last;
  std::span<const std::int32_t> row;
  int rows;
  std::span<const double> azimuth_rad;
  std::vector<std::size_t> order;

  Numbered(std::vector<std::int64_t> numbers, std::int64_t least, std::int64_t most,
           const BeamRows& beam_rows, std::span<const double> azimuths_rad)
      : number(std::move(numbers)),
        first(least),
        last(most),
        row(beam_rows.row),
        rows(beam_rows.count),
        azimuth_rad(azimuths_rad),
        order(number.size()) {
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, [this](std::size_t a, std::size_t b) {
      return std::tuple(row[a], number[a], a) < std::tuple(row[b], number[b], b);
    });
  }

  std::int64_t span() const { return last - first + 1; }
  bool is_of_row(std::size_t place, std::size_t of) const {
    return place < order.size() && row[order[place]] == row[order[of]];
  }

  /// Calls use(a, b, columns) for consecutive returns of one ring that are some columns apart.
  template <typename F>
  void for_each_step(const F& use) const {
    for (std::size_t i = 1; i < order.size(); ++i) {
      const std::size_t a = order[i - 1], b = order[i];
      if (row[a] == row[b] && number[a] != number[b])
        use(a, b, static_cast<double>(number[b] - number[a]));
    }
  }
};

/// Returns the increase of azimuth per column; 0 if it is not approximately constant.
double slope_rad(const Numbered& pulses) {
  std::vector<double> slopes;
  const auto slope = [&](std::size_t a, std::size_t b, double columns) {
    return wrapped(pulses.azimuth_rad[b] - pulses.azimuth_rad[a]) / columns;
  };
  pulses.for_each_step([&](std::size_t a, std::size_t b, double columns) {
    if (columns <= 4) slopes.push_back(slope(a, b, columns));
  });
  if (slopes.empty()) return 0;
  const double median = upper_median(slopes);
  if (std::abs(median) < least_slope_rad) return 0;
  const auto like = std::ranges::count_if(
      slopes, [median](double s) { return std::abs(s - median) <= std::abs(median) / 2; });
  if (static_cast<double>(like) < 0.75 * static_cast<double>(slopes.size())) return 0;
  double turned = 0, passed = 0;  // over the whole scan, which gives the mean
  pulses.for_each_step([&](std::size_t a, std::size_t b, double columns) {
    if (columns > 64) return;
    const double guess = median * columns;
    const double off = wrapped(pulses.azimuth_rad[b] - pulses.azimuth_rad[a] - guess);
    if (std::abs(off) > std::abs(guess) / 2) return;
    turned += guess + off;
    passed += columns;
  });
  return passed > 0 ? turned / passed : median;
}

/// Calls use(first, last) for the first and last return of each ring.
template <typename F>
void for_each_ring(const Numbered& pulses, const F& use) {
  for (std::size_t i = 0, next = 0; i < pulses.order.size(); i = next) {
    while (pulses.is_of_row(next, i)) ++next;
    use(pulses.order[i], pulses.order[next - 1]);
  }
}

/// Returns the number of columns in a turn: that of the slope, but no fewer than a ring has and no
/// more than there are. Rings that fire later than others may continue their numbers.
std::int64_t turn_of(const Numbered& pulses, double slope) {
  std::int64_t longest = 0;
  for_each_ring(pulses, [&](std::size_t first, std::size_t last) {
    longest = std::max(longest, pulses.number[last] - pulses.number[first] + 1);
  });
  return std::clamp(std::llround(two_pi / std::abs(slope)), static_cast<long long>(longest),
                    static_cast<long long>(pulses.span()));
}

/// Returns true if azimuth continues from a ring's last column to its first, by more than zero and
/// at most one and a half columns.
bool goes_round(const Numbered& pulses, double slope, std::int64_t turn) {
  const double turns = std::abs(slope) * static_cast<double>(turn) / two_pi;
  if (turn < 3 || std::abs(turns - 1) > 0.02) return false;
  std::vector<double> off;  // from the expected step, in columns
  for_each_ring(pulses, [&](std::size_t first, std::size_t last) {
    const std::int64_t columns = turn - (pulses.number[last] - pulses.number[first]);
    if (columns > 64) return;
    const double step_rad = slope * static_cast<double>(columns);
    off.push_back(wrapped(pulses.azimuth_rad[first] - pulses.azimuth_rad[last] - step_rad) / slope);
  });
  if (off.empty()) return false;
  const double middle = upper_median(off);
  return -1 < middle && middle <= 0.5;
}

/// Returns the offset of each ring in columns; zeros if the offsets are not constant.
std::vector<std::int64_t> aside(const Numbered& pulses, double slope) {
  const auto rows = static_cast<std::size_t>(pulses.rows);
  std::vector<Phasor> sum(rows);
  const auto rest = [&](std::size_t i) {
    return pulses.azimuth_rad[i] - slope * static_cast<double>(pulses.number[i] - pulses.first);
  };
  for (std::size_t i = 0; i < pulses.number.size(); ++i)
    sum[static_cast<std::size_t>(pulses.row[i])] += phasor_of(rest(i));
  std::vector<double> off;
  for (std::size_t i = 0; i < pulses.number.size(); ++i)
    off.push_back(
        std::abs(wrapped(rest(i) - phase_rad(sum[static_cast<std::size_t>(pulses.row[i])]))));
  std::vector<std::int64_t> shift(rows, 0);
  if (upper_median(off) > 2 * std::abs(slope)) return shift;
  std::vector<double> turned;
  double zero = 0;
  for (int pass = 0; pass < 2; ++pass) {  // about the first ring, then about the median
    turned.clear();
    for (const Phasor& s : sum) {
      if (s != 0.0) turned.push_back(wrapped(phase_rad(s) - zero));
    }
    if (!turned.empty()) zero += upper_median(turned);
  }
  for (std::size_t r = 0; r < rows; ++r) {
    if (sum[r] != 0.0) shift[r] = std::llround(wrapped(phase_rad(sum[r]) - zero) / slope);
  }
  return shift;
}

BeamColumns columns_of_pulses(Numbered& pulses, RowOrder order) {
  BeamColumns columns;
  if (pulses.number.empty()) return columns;
  double slope = slope_rad(pulses);
  const std::int64_t turn = slope == 0 ? pulses.span() : turn_of(pulses, slope);
  columns.is_round = slope != 0 && goes_round(pulses, slope, turn);
  std::vector<std::int64_t> shift(static_cast<std::size_t>(pulses.rows), 0);
  if (slope != 0 && order == RowOrder::Elevation) shift = aside(pulses, slope);
  std::int64_t first = 0, last = (columns.is_round ? turn : pulses.span()) - 1;
  for (std::size_t i = 0; i < pulses.number.size(); ++i) {
    std::int64_t column =
        pulses.number[i] - pulses.first + shift[static_cast<std::size_t>(pulses.row[i])];
    if (columns.is_round) column = ((column % turn) + turn) % turn;
    first = std::min(first, column);
    last = std::max(last, column);
    columns.column.push_back(column);
  }
  for (std::int64_t& column : columns.column) column -= first;
  columns.count = last - first + 1;
  return columns;
}

/// Returns true if, with few exceptions, all returns of a firing time belong to one pulse: they
/// have one azimuth and are not many.
bool has_distinct_pulses(const Numbered& pulses, std::span<const float> off) {
  const double least_rad = std::abs(slope_rad(pulses)) / 4;
  std::size_t crowded = 0, cells = 0, first = 0;
  for (std::size_t i = 0; i < pulses.order.size(); ++i) {
    const std::size_t a = pulses.order[first], b = pulses.order[i];
    if (i == 0 || pulses.row[a] != pulses.row[b] || pulses.number[a] != pulses.number[b]) {
      first = i;
      ++cells;
      continue;
    }
    const double turned_rad = wrapped(pulses.azimuth_rad[b] - pulses.azimuth_rad[a]);
    if (std::abs(turned_rad) > least_rad && std::abs(off[a] - off[b]) < 1.f / 16) ++crowded;
  }
  return 50 * crowded <= pulses.number.size() && 8 * cells >= pulses.number.size();
}

constexpr std::size_t least_share = 4;   // at most one of this many may turn the other way
constexpr std::size_t least_above = 10;  // at least one of this many must have one above
constexpr double one_row_rad = 5e-2;     // median deviation of elevations from their median
constexpr double degrees = 180 / std::numbers::pi;

/// Numbers of cells by the sense in which their neighbours turn.
struct Turning {
  std::size_t left = 0, right = 0;
};

Turning turning_of(const OrganisedScan& scan) {
  const auto rows = static_cast<std::size_t>(scan.rows);
  const auto columns = static_cast<std::size_t>(scan.columns);
  const auto way_m = [&](std::size_t cell) { return scan.points_m[cell] - scan.origins_m[cell]; };
  Turning turning;
  for (std::size_t row = 0; row + 1 < rows; ++row) {
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      const std::size_t cell = row * columns + column;
      const double turn = glm::dot(way_m(cell), glm::cross(way_m(cell + 1), way_m(cell + columns)));
      if (turn > 0) ++turning.left;  // NaN is neither
      if (turn < 0) ++turning.right;
    }
  }
  return turning;
}

/// Returns the median absolute deviation of the returns' elevations.
double elevation_spread_rad(const OrganisedScan& scan) {
  std::vector<double> elevations_rad;
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    const glm::dvec3 way_m = scan.points_m[i] - scan.origins_m[i];
    if (!std::isnan(way_m.x))
      elevations_rad.push_back(math::atan2(way_m.z, math::hypot(way_m.x, way_m.y)));
  }
  if (elevations_rad.size() <= few_returns) return 0;
  const double median_rad = upper_median(elevations_rad);
  for (double& e : elevations_rad) e = std::abs(e - median_rad);
  return upper_median(elevations_rad);
}

}  // namespace

BeamColumns columns_of_numbers(std::span<const std::int32_t> numbers, std::int32_t first,
                               std::int32_t last, const BeamRows& rows,
                               std::span<const double> azimuths_rad, RowOrder order) {
  Numbered pulses({numbers.begin(), numbers.end()}, first, last, rows, azimuths_rad);
  BeamColumns columns = columns_of_pulses(pulses, order);
  columns.off.assign(numbers.size(), 0);
  return columns;
}

std::optional<BeamColumns> columns_of_times(std::span<const double> times_s, const BeamRows& rows,
                                            std::span<const double> azimuths_rad, RowOrder order) {
  if (times_s.empty()) return std::nullopt;
  FiringLattice lattice = number_firings(times_s, rows.row, rows.count, 0);
  if (lattice.coherence < 0.5) return std::nullopt;
  const auto [first, last] = std::ranges::minmax(lattice.number);
  const double cells = static_cast<double>(last - first + 1) * rows.count;
  if (cells > most_cells_each * static_cast<double>(times_s.size())) return std::nullopt;
  Numbered pulses(std::move(lattice.number), first, last, rows, azimuths_rad);
  if (!has_distinct_pulses(pulses, lattice.off)) return std::nullopt;
  BeamColumns columns = columns_of_pulses(pulses, order);
  columns.off = std::move(lattice.off);
  return columns;
}

BeamColumns columns_of_azimuths(const BeamRows& rows, std::span<const double> azimuths_rad) {
  BeamColumns columns;
  if (azimuths_rad.empty()) return columns;
  FiringLattice lattice = number_firings(azimuths_rad, rows.row, rows.count, two_pi);
  if (lattice.evenness < 0.2 && azimuths_rad.size() > few_returns) {
    throw Error(
        "the azimuths of the rings' returns are not equally spaced (evenness {:.2f} of 1, steps of "
        "{:.4f} degrees): give the columns, or link them as points without order",
        lattice.evenness, lattice.step * 360 / two_pi);
  }
  const std::int64_t turn = std::max<std::int64_t>(lattice.period, 1);
  std::vector<bool> is_used(static_cast<std::size_t>(turn), false);
  for (std::int64_t& number : lattice.number) {
    number = ((number % turn) + turn) % turn;
    is_used[static_cast<std::size_t>(number)] = true;
  }
  std::int64_t gap = 0, run = 0, begin = 0;  // end of the widest gap
  for (std::int64_t i = 0; i < 2 * turn && run < turn; ++i) {
    run = is_used[static_cast<std::size_t>(i % turn)] ? 0 : run + 1;
    if (run <= gap) continue;
    gap = run;
    begin = i + 1;
  }
  if (gap <= narrow) gap = begin = 0;
  columns.is_round = gap == 0 && turn > 2;
  columns.count = turn - gap;
  for (const std::int64_t number : lattice.number)
    columns.column.push_back((number - begin % turn + turn) % turn);
  columns.off = std::move(lattice.off);
  return columns;
}

void check_rows_meet(const OrganisedScan& scan) {
  const auto columns = static_cast<std::size_t>(scan.columns);
  const std::vector<std::uint32_t>& chosen = scan.returns;
  std::size_t used = 0, above = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i] == OrganisedScan::none) continue;
    ++used;
    above += i + columns < chosen.size() && chosen[i + columns] != OrganisedScan::none;
  }
  if (scan.rows < 2 || used <= few_returns || least_above * above >= used) return;
  throw Error(
      "the returns have no ring numbers; their elevations suggest {} beams, but only {} of {} "
      "returns have a neighbour in the next beam: give the rings, or link them as points without "
      "order",
      scan.rows, above, used);
}

void check_beams_turn(const OrganisedScan& scan) {
  const Turning turning = turning_of(scan);
  const std::size_t all = turning.left + turning.right;
  const std::size_t fewer = std::min(turning.left, turning.right);
  if (all > few_returns && least_share * fewer > all) {
    throw Error(
        "the beams form no grid of rows and columns: of {} neighbours {} turn one way and {} the "
        "other, as in a rosette or for points that are not in the sensor's frame: give the "
        "sensor's pose, or link them as points without order",
        all, all - fewer, fewer);
  }
  if (scan.rows != 1) return;
  const double spread = elevation_spread_rad(scan);
  if (spread <= one_row_rad) return;
  throw Error(
      "all returns have the same ring, but their elevations deviate by {:.1f} degrees from the "
      "median: it is no row of a grid: give the rings, or link them as points without order",
      spread * degrees);
}

}  // namespace groundray
