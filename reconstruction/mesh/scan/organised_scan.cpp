#include "reconstruction/mesh/scan/organised_scan.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "reconstruction/mesh/mesh_arrays.h"
#include "reconstruction/mesh/scan/beam_columns.h"
#include "reconstruction/mesh/scan/beam_rows.h"

namespace groundray {
namespace {

constexpr double farthest_point_m = 1e15;  // as check_mesh
constexpr double longest_s = 1e12;
constexpr float one_pulse = 1.f / 16;  // of a column, between returns of one pulse

bool is_position(const glm::dvec3& p) {
  return std::abs(p.x) <= farthest_point_m && std::abs(p.y) <= farthest_point_m &&
         std::abs(p.z) <= farthest_point_m;
}

void check_returns(const ScanReturns& returns, ReturnChoice choice) {
  Violations broken("the returns of a scan");
  const std::size_t rows = returns.p_S.size();
  const auto check = [&](const char* name, std::size_t size) {
    broken.unless(size == 0 || size == rows, "{} has {} values; it must have {}, like p_S, or none",
                  name, size, rows);
  };
  check("origins_m", returns.origins_m.size());
  check("rings", returns.rings.size());
  check("columns", returns.columns.size());
  check("times_s", returns.times_s.size());
  check("intensity", returns.intensity.size());
  check("sd_m", returns.sd_m.size());
  check("labels", returns.labels.size());
  broken.unless(rows < OrganisedScan::none, "{} rows are too many: the limit is {}", rows,
                OrganisedScan::none - 1);
  broken.unless(choice != ReturnChoice::Strongest || !returns.intensity.empty() || rows == 0,
                "the strongest return is requested, but there is no intensity");
  const auto bad = std::ranges::find_if(
      returns.sd_m, [](float sd) { return !(sd >= 0 && sd <= farthest_point_m); });
  broken.unless(bad == returns.sd_m.end(), "sd_m of row {} = {} must be >= 0 and finite",
                bad - returns.sd_m.begin(), bad == returns.sd_m.end() ? 0.f : *bad);
  broken.throw_if_any();
}

/// Valid returns of a table, and the directions of their beams.
struct Beams {
  std::vector<std::uint32_t> source;  // row of the table
  std::vector<double> azimuth_rad;    // [0, 2 pi)
  std::vector<double> elevation_rad;
  std::vector<double> plan_m;  // horizontal range
  std::vector<double> range_m;
};

Beams beams_of_returns(const ScanReturns& returns) {
  Beams beams;
  for (std::size_t i = 0; i < returns.p_S.size(); ++i) {
    const glm::dvec3& p = returns.p_S[i];
    const glm::dvec3 origin = returns.origins_m.empty() ? glm::dvec3(0) : returns.origins_m[i];
    if (!is_position(p) || !is_position(origin) || p == glm::dvec3(0) || p == origin) continue;
    const glm::dvec3 way = p - origin;
    const double turn = 2 * std::numbers::pi;
    double azimuth_rad = math::atan2(way.y, way.x);
    if (azimuth_rad < 0) azimuth_rad += turn;
    beams.source.push_back(static_cast<std::uint32_t>(i));
    beams.azimuth_rad.push_back(azimuth_rad < turn ? azimuth_rad : 0);
    beams.plan_m.push_back(math::hypot(way.x, way.y));
    beams.elevation_rad.push_back(math::atan2(way.z, beams.plan_m.back()));
    beams.range_m.push_back(glm::length(way));
  }
  return beams;
}

BeamRows rows_of(const ScanReturns& returns, const Beams& beams, RowOrder order) {
  if (returns.rings.empty()) {
    if (auto rows = rows_of_elevations(beams.elevation_rad)) return *std::move(rows);
    if (auto rows = rows_of_turns(beams.azimuth_rad, beams.elevation_rad)) return *std::move(rows);
    throw Error(
        "the returns have no ring numbers; their {} elevations do not cluster by beam, and the "
        "table is not ordered by ring: give the rings, or link them as points without order",
        beams.source.size());
  }
  if (order == RowOrder::Elevation)
    return rows_of_rings(picked(returns.rings, beams.source), beams.elevation_rad, order);
  // Lines without a return keep their rows.
  BeamRows all = rows_of_rings(returns.rings, {}, order);
  return {picked(all.row, beams.source), all.count};
}

/// Returns azimuths that show the offsets of rings: for de-skewed points, without the parallax
/// caused by the sensor's motion.
std::vector<double> azimuths_of(const std::vector<double>& clock, const Beams& beams,
                                const BeamRows& rows, RowOrder order) {
  if (order == RowOrder::Number) return beams.azimuth_rad;  // lines of an image
  auto as_fired = azimuths_as_fired(clock, rows, {beams.azimuth_rad, beams.plan_m});
  return as_fired ? *std::move(as_fired) : beams.azimuth_rad;
}

BeamColumns columns_of_returns(const ScanReturns& returns, const Beams& beams, const BeamRows& rows,
                               RowOrder order) {
  if (!returns.columns.empty()) {
    const auto [first, last] = std::ranges::minmax(returns.columns);
    const std::vector<std::int32_t> numbers = picked(returns.columns, beams.source);
    const std::vector<double> clock(numbers.begin(), numbers.end());
    return columns_of_numbers(numbers, first, last, rows, azimuths_of(clock, beams, rows, order),
                              order);
  }
  if (!returns.times_s.empty()) {
    const std::vector<double> times_s = picked(returns.times_s, beams.source);
    const bool are_times =
        std::ranges::all_of(times_s, [](double t) { return std::abs(t) <= longest_s; });
    if (are_times) {
      if (auto columns =
              columns_of_times(times_s, rows, azimuths_of(times_s, beams, rows, order), order))
        return *std::move(columns);
    }
  }
  return columns_of_azimuths(rows, beams.azimuth_rad);
}

void check_size(const BeamRows& rows, const BeamColumns& columns, std::size_t returns) {
  const double cells = static_cast<double>(rows.count) * static_cast<double>(columns.count);
  const double most = std::min(1e6 + 1000 * static_cast<double>(returns), 2147483647.0);
  if (cells <= most) return;
  throw Error(
      "{} rows and {} columns are too many cells for {} returns: the numbers of rings and columns "
      "must be consecutive",
      rows.count, columns.count, returns);
}

/// Positions of returns on the grid.
struct Places {
  std::vector<std::size_t> cell;  // of each return
  std::vector<float> off;         // columns, from its centre
  int columns = 0;
  std::size_t cells = 0;
  bool is_round = false;

  /// Returns the adjacent cell of the row, before (-1) or after (1); `cells` if there is none.
  std::size_t beside(std::size_t from, int side) const {
    const auto width = static_cast<std::size_t>(columns);
    const std::size_t column = from % width;
    if (side < 0 && column == 0) return is_round ? from + width - 1 : cells;
    if (side > 0 && column + 1 == width) return is_round ? from + 1 - width : cells;
    return side < 0 ? from - 1 : from + 1;
  }
  bool is_one_pulse(std::uint32_t a, std::uint32_t b) const {
    return cell[a] == cell[b] && std::abs(off[a] - off[b]) <= one_pulse;
  }
};

Places places_of(const BeamRows& rows, BeamColumns columns) {
  Places places{.off = std::move(columns.off),
                .columns = static_cast<int>(columns.count),
                .is_round = columns.is_round};
  places.cells = static_cast<std::size_t>(rows.count) * static_cast<std::size_t>(columns.count);
  for (std::size_t i = 0; i < rows.row.size(); ++i)
    places.cell.push_back(
        static_cast<std::size_t>(rows.row[i] * columns.count + columns.column[i]));
  return places;
}

/// Moves pulses whose cell has another one nearer to its centre to the adjacent cell if that is
/// empty: pulses are in order, but not at exactly equal steps. Other returns get no cell.
/// @return cell of each return, or `places.cells`.
std::vector<std::size_t> spread(const Places& places) {
  std::vector<std::uint32_t> nearest(places.cells, OrganisedScan::none);
  for (std::uint32_t i = 0; i < places.cell.size(); ++i) {
    std::uint32_t& held = nearest[places.cell[i]];
    if (held == OrganisedScan::none || std::abs(places.off[i]) < std::abs(places.off[held]))
      held = i;
  }
  const auto side_of = [&](std::uint32_t i) {
    const std::uint32_t held = nearest[places.cell[i]];
    return places.is_one_pulse(i, held) ? 0 : places.off[i] < places.off[held] ? -1 : 1;
  };
  std::vector<std::uint32_t> claims(places.cells, OrganisedScan::none);
  for (std::uint32_t i = 0; i < places.cell.size(); ++i) {
    const int side = side_of(i);
    if (side == 0) continue;
    const std::size_t target = places.beside(places.cell[i], side);
    if (target == places.cells || nearest[target] != OrganisedScan::none) continue;
    const auto way = [&](std::uint32_t k) {
      return std::abs(1 - std::abs(places.off[k] - places.off[nearest[places.cell[k]]]));
    };
    std::uint32_t& held = claims[target];
    if (held == OrganisedScan::none || way(i) < way(held)) held = i;
  }
  std::vector<std::size_t> cell = places.cell;
  for (std::uint32_t i = 0; i < cell.size(); ++i) {
    const int side = side_of(i);
    if (side == 0) continue;
    const std::size_t target = places.beside(places.cell[i], side);
    const bool is_sent = target < places.cells && claims[target] != OrganisedScan::none &&
                         places.is_one_pulse(i, claims[target]);
    cell[i] = is_sent ? target : places.cells;
  }
  return cell;
}

/// Chooses the return used for each cell; `none` for an empty cell.
std::vector<std::uint32_t> choose(const ScanReturns& returns, const Beams& beams,
                                  const Places& places, ReturnChoice choice,
                                  OrganisedCounts& counts) {
  const auto is_better = [&](std::uint32_t a, std::uint32_t b) {
    if (choice == ReturnChoice::Last) return beams.range_m[a] > beams.range_m[b];
    if (choice == ReturnChoice::First) return beams.range_m[a] < beams.range_m[b];
    return returns.intensity[beams.source[a]] > returns.intensity[beams.source[b]];
  };
  const std::vector<std::size_t> cell = spread(places);
  std::vector<std::uint32_t> chosen(places.cells, OrganisedScan::none);
  for (std::uint32_t i = 0; i < cell.size(); ++i) {
    if (cell[i] == places.cells) {
      ++counts.crowded;
      continue;
    }
    std::uint32_t& held = chosen[cell[i]];
    if (held != OrganisedScan::none) ++counts.other_returns;
    if (held == OrganisedScan::none || is_better(i, held)) held = i;
  }
  return chosen;
}

OrganisedScan empty_scan(int rows, int columns, bool with_labels) {
  const auto cells = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
  const glm::dvec3 nothing(std::numeric_limits<double>::quiet_NaN());
  OrganisedScan scan{.rows = rows, .columns = columns};
  scan.points_m.assign(cells, nothing);
  scan.origins_m.assign(cells, nothing);
  scan.sd_m.assign(cells, 0);
  if (with_labels) scan.labels.assign(cells, 0);
  scan.returns.assign(cells, OrganisedScan::none);
  return scan;
}

}  // namespace

OrganisedReturns organise(const ScanReturns& returns, ReturnChoice choice, RowOrder order) {
  check_returns(returns, choice);
  const Beams beams = beams_of_returns(returns);
  OrganisedReturns made;
  made.counts.no_returns = returns.p_S.size() - beams.source.size();
  const BeamRows rows = rows_of(returns, beams, order);
  BeamColumns columns = columns_of_returns(returns, beams, rows, order);
  check_size(rows, columns, returns.p_S.size());
  made.scan = empty_scan(rows.count, static_cast<int>(columns.count), !returns.labels.empty());
  made.scan.is_round = columns.is_round;
  const Places places = places_of(rows, std::move(columns));
  const auto chosen = choose(returns, beams, places, choice, made.counts);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i] == OrganisedScan::none) continue;
    const std::uint32_t row = beams.source[chosen[i]];
    made.scan.returns[i] = row;
    made.scan.points_m[i] = returns.p_S[row];
    made.scan.origins_m[i] = returns.origins_m.empty() ? glm::dvec3(0) : returns.origins_m[row];
    if (!returns.sd_m.empty()) made.scan.sd_m[i] = returns.sd_m[row];
    if (!returns.labels.empty()) made.scan.labels[i] = returns.labels[row];
  }
  if (returns.rings.empty()) check_rows_meet(made.scan);
  if (order == RowOrder::Elevation) check_beams_turn(made.scan);
  return made;
}

OrganisedScan place(OrganisedScan scan, const Pose& X_DS) {
  for (glm::dvec3& p : scan.points_m) p = X_DS * p;
  for (glm::dvec3& o : scan.origins_m) o = X_DS * o;
  return scan;
}

OrganisedScan place(OrganisedScan scan, const Trajectory& X_DS, std::chrono::nanoseconds stamp,
                    std::span<const double> times_s) {
  check_scan(scan, "the scan to place");
  if (scan.returns.size() != scan.points_m.size()) {
    throw Error("the scan to place has no return numbers for its cells: was it organised?");
  }
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    const std::uint32_t row = scan.returns[i];
    if (row == OrganisedScan::none) continue;
    if (row >= times_s.size() || !(std::abs(times_s[row]) < 9e9)) {
      throw Error("the return in row {} must have a finite time within 9e9 s; there are {} times",
                  row, times_s.size());
    }
    const std::chrono::nanoseconds after(std::llround(times_s[row] * 1e9));
    const Pose X_DS_fired = X_DS.pose_at(stamp + after);
    scan.points_m[i] = X_DS_fired * scan.points_m[i];
    scan.origins_m[i] = X_DS_fired * scan.origins_m[i];
  }
  return scan;
}

void check_scan(const OrganisedScan& scan, const char* name) {
  Violations broken(name);
  broken.unless(scan.rows >= 0 && scan.columns >= 0, "rows = {} and columns = {} must be >= 0",
                scan.rows, scan.columns);
  const std::size_t cells = static_cast<std::size_t>(std::max(scan.rows, 0)) *
                            static_cast<std::size_t>(std::max(scan.columns, 0));
  const auto check = [&](const char* list, std::size_t size, bool may_lack) {
    broken.unless(size == cells || (may_lack && size == 0), "{} has {} values for {} cells", list,
                  size, cells);
  };
  broken.unless(cells < OrganisedScan::none, "{} cells are too many: the limit is {}", cells,
                OrganisedScan::none - 1);
  check("points_m", scan.points_m.size(), false);
  check("origins_m", scan.origins_m.size(), false);
  check("sd_m", scan.sd_m.size(), false);
  check("labels", scan.labels.size(), true);
  check("returns", scan.returns.size(), true);
  const auto bad_sd = std::ranges::find_if(
      scan.sd_m, [](float sd) { return !(sd >= 0 && sd <= farthest_point_m); });
  broken.unless(bad_sd == scan.sd_m.end(), "sd_m of cell {} must be >= 0 and finite",
                bad_sd - scan.sd_m.begin());
  const auto is_far = [](const glm::dvec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > farthest_point_m;  // not NaN
  };
  const auto far = std::ranges::find_if(scan.points_m, is_far);
  broken.unless(far == scan.points_m.end(),
                "the point of cell {} must be within 1e15 m of zero, or NaN without a return",
                far - scan.points_m.begin());
  const auto far_origin = std::ranges::find_if(scan.origins_m, is_far);
  broken.unless(far_origin == scan.origins_m.end(),
                "the origin of cell {} must be within 1e15 m of zero, or NaN",
                far_origin - scan.origins_m.begin());
  broken.throw_if_any();
}

}  // namespace groundray
