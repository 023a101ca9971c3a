#include "reconstruction/mesh/scan/grid_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/error.h"

namespace groundray {
namespace {

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
      elevations_rad.push_back(std::atan2(way_m.z, std::hypot(way_m.x, way_m.y)));
  }
  if (elevations_rad.size() <= few_returns) return 0;
  const auto middle = [&] {
    const auto at = elevations_rad.begin() + static_cast<std::ptrdiff_t>(elevations_rad.size() / 2);
    std::ranges::nth_element(elevations_rad, at);
    return *at;
  };
  const double median_rad = middle();
  for (double& e : elevations_rad) e = std::abs(e - median_rad);
  return middle();
}

}  // namespace

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
