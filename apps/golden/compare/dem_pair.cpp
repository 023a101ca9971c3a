#include "apps/golden/compare/dem_pair.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <optional>

namespace groundray::golden {
namespace {

constexpr double same_place = 1e-6;  // cells; rounding of geotransforms in text and floats

bool is_whole(glm::dvec2 at) { return at == glm::round(at); }

/// Returns `at` with each coordinate that is within `same_place` of a whole number rounded to it.
glm::dvec2 snapped(glm::dvec2 at) {
  for (glm::length_t i = 0; i < 2; ++i) {
    if (std::abs(at[i] - std::round(at[i])) <= same_place) at[i] = std::round(at[i]);
  }
  return at;
}

/// Returns the height of the surface at grid coordinates within the grid, m; NaN in a hole.
double height_m_at(const HeightGrid& grid, glm::dvec2 at) {
  if (is_whole(at)) return grid.height_m(static_cast<int>(at.x), static_cast<int>(at.y));
  const Cell cell = grid.cell(std::min(static_cast<int>(at.x), grid.columns() - 2),
                              std::min(static_cast<int>(at.y), grid.rows() - 2));
  const FacetPlane plane = cell.plane(cell.half_at(at.x, at.y));
  return plane.height_m + plane.u_slope_m * at.x + plane.v_slope_m * at.y;
}

/// Returns the grid coordinates of a position in D; nothing outside the grid.
std::optional<glm::dvec2> place_in(const HeightGrid& grid, const glm::dvec2& p) {
  const glm::dvec2 at = snapped(grid.frame().to_grid(p));
  const glm::ivec2 last = grid.frame().samples - 1;
  if (!(0 <= at.x && at.x <= last.x && 0 <= at.y && at.y <= last.y)) return std::nullopt;
  return at;
}

}  // namespace

DemPair paired(const Dem& reference, const Dem& other, const Scope& scope) {
  const HeightGrid& grid = reference.grid;
  const Heights none{Image<double>(grid.columns(), grid.rows(), 1)};
  DemPair pair{grid.frame(), none, none};
  std::ranges::copy(grid.heights_m(), pair.reference.m.values().begin());
  std::ranges::fill(pair.other.m.values(), std::numeric_limits<double>::quiet_NaN());
  const glm::dvec2 shift_m(reference.origin_w_m - other.origin_w_m);
  const double up_m = other.origin_w_m.z - reference.origin_w_m.z;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const glm::dvec2 p_D = grid.frame().to_D({column, row});
      const auto at = place_in(other.grid, p_D + shift_m);
      double& height_m = pair.other.m.at(column, row)[0];
      if (at) height_m = height_m_at(other.grid, *at) + up_m;
      const double of_reference = pair.reference(column, row);
      const glm::dvec3 p_W = glm::dvec3(p_D, std::isnan(of_reference) ? height_m : of_reference) +
                             reference.origin_w_m;
      const bool is_in = scope.contains(p_W);
      const bool is_ignored = is_in && std::abs(height_m - of_reference) > scope.ignore_beyond_m;
      pair.is_left_out.push_back(!is_in || is_ignored);
      pair.outside += is_in ? 0 : 1;
      pair.ignored += is_ignored ? 1 : 0;
      pair.beyond += is_in && !at ? 1 : 0;
      pair.interpolated += is_in && at && !is_whole(*at) ? 1 : 0;
    }
  }
  return pair;
}

}  // namespace groundray::golden
