#include "reconstruction/dem/fusion/bent_plane.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace groundray {
namespace {

constexpr std::size_t parts_across = 4, parts = parts_across * parts_across;
// With fewer, or with points along a few lines, errors of single points would bend the plane.
constexpr std::size_t enough_points = 32, enough_parts = 12;
constexpr std::size_t first_slope = 1, first_bend = 3;  // rows of the terms in the matrix
constexpr double least_bend_m2 = 1e-12;

// Sums over the points of a part of the cell, by weight.
struct Part {
  double weight = 0;
  double off = 0;
};

std::size_t part_of(const CellColumns& points, std::size_t i, glm::dvec2 step_m) noexcept {
  const auto place = [](double cells) {
    constexpr double last = parts_across - 1;
    return static_cast<std::size_t>(std::clamp((cells + 0.5) * parts_across, 0.0, last));
  };
  return parts_across * place(double{points.y_m[i]} / std::abs(step_m.y)) +
         place(double{points.x_m[i]} / std::abs(step_m.x));
}

// Sums the normal equations of a bent plane, relative to the plane `about`.
NormalEquations bent_equations(const CellColumns& points, const SurfacePlane& about,
                               glm::dvec2 step_m) noexcept {
  const auto h = static_cast<float>(about.height_m), a = static_cast<float>(about.slope_x),
             b = static_cast<float>(about.slope_y);
  const glm::vec2 cells_per_m(1.0 / step_m);
  std::array<std::array<FloatLanes, 6>, 6> moments{};
  std::array<FloatLanes, 6> heights{};
  for (std::size_t i = 0; i < points.padded; i += lanes) {
    const FloatLanes off =
        load(&points.z_m[i]) - h - a * load(&points.x_m[i]) - b * load(&points.y_m[i]);
    const std::array<FloatLanes, 6> by = bent_plane_functions(points, i, cells_per_m);
    for (std::size_t j = 0; j < by.size(); ++j) {
      const FloatLanes one = load(&points.weight[i]) * by[j];
      heights[j] += one * off;
      for (std::size_t k = 0; k <= j; ++k) moments[j][k] += one * by[k];
    }
  }
  NormalEquations found;
  for (std::size_t j = 0; j < found.right.size(); ++j) {
    found.right[j] = double{total(heights[j])};
    for (std::size_t k = 0; k <= j; ++k) found.matrix[j][k] = double{total(moments[j][k])};
  }
  return found;
}

}  // namespace

BentPlane fit_bent_plane(const CellColumns& points, const SurfacePlane& about,
                         const NeighbourSurface& neighbours, const SurfaceBend& bend_m2,
                         glm::dvec2 step_m) noexcept {
  NormalEquations sums = bent_equations(points, about, step_m);
  // Information on the rise across a cell, and on the bend.
  const double xx = neighbours.information_xx / (step_m.x * step_m.x),
               xy = neighbours.information_xy / (step_m.x * step_m.y),
               yy = neighbours.information_yy / (step_m.y * step_m.y);
  const double rise_x = (neighbours.plane.slope_x - about.slope_x) * step_m.x,
               rise_y = (neighbours.plane.slope_y - about.slope_y) * step_m.y;
  const std::array<double, 3> bend{1 / (bend_m2.xx + least_bend_m2),
                                   1 / (bend_m2.xy + least_bend_m2),
                                   1 / (bend_m2.yy + least_bend_m2)};
  // Rounding of the sums, which are floats, must not take information from the neighbours'.
  for (std::size_t k = 1; k < sums.right.size(); ++k) {
    const double mean = sums.matrix[k][0] / sums.matrix[0][0];
    sums.matrix[k][k] = std::max(sums.matrix[k][k], sums.matrix[k][0] * mean);
  }
  sums.matrix[first_slope][first_slope] += xx;
  sums.matrix[first_slope + 1][first_slope] += xy;
  sums.matrix[first_slope + 1][first_slope + 1] += yy;
  sums.right[first_slope] += xx * rise_x + xy * rise_y;
  sums.right[first_slope + 1] += xy * rise_x + yy * rise_y;
  for (std::size_t k = 0; k < bend.size(); ++k)
    sums.matrix[first_bend + k][first_bend + k] += bend[k];

  const QuadricFit fit = solve(sums);
  BentPlane found{fit.terms, fit.covariance()};
  const QuadricMatrix& c = found.covariance;
  found.fitted = 6 - c[first_slope][first_slope] * xx - 2 * c[first_slope][first_slope + 1] * xy -
                 c[first_slope + 1][first_slope + 1] * yy;
  for (std::size_t k = 0; k < bend.size(); ++k)
    found.fitted -= c[first_bend + k][first_bend + k] * bend[k];
  return found;
}

bool has_points_throughout(const CellColumns& points, glm::dvec2 step_m) noexcept {
  if (points.count < enough_points) return false;
  std::array<std::size_t, parts> counts{};
  for (std::size_t i = 0; i < points.count; ++i)
    if (points.weight[i] > 0) ++counts[part_of(points, i, step_m)];
  const auto seen = parts - static_cast<std::size_t>(std::ranges::count(counts, std::size_t{0}));
  return seen >= enough_parts &&
         std::accumulate(counts.begin(), counts.end(), std::size_t{0}) >= enough_points;
}

double scatter_m2(const CellColumns& points, const SurfacePlane& plane, double fitted,
                  double expected_m2, glm::dvec2 step_m) noexcept {
  constexpr double prior_points = 10;  // weight of the stated noise against the measured one
  std::array<Part, parts> sums{};
  // Weights may be any multiple of 1 / variance, so the stated noise is summed with them.
  double square = 0, stated = 0, count = 0;
  for (std::size_t i = 0; i < points.count; ++i) {
    const double weight = points.weight[i];
    if (!(weight > 0)) continue;
    const double off = double{points.z_m[i]} - plane.height_m -
                       plane.slope_x * double{points.x_m[i]} -
                       plane.slope_y * double{points.y_m[i]};
    Part& part = sums[part_of(points, i, step_m)];
    part.weight += weight;
    part.off += weight * off;
    square += weight * off * off;
    stated += weight * double{points.variance_m2[i]};
    ++count;
  }
  double weight = 0, between = 0, seen = 0;
  for (const Part& part : sums) {
    if (!(part.weight > 0)) continue;
    weight += part.weight;
    between += part.off * part.off / part.weight;
    ++seen;
  }
  const double freedom = seen - fitted;  // at least 6 of enough_parts
  const double noise =
      (square - between + prior_points * stated / count) / (count - seen + prior_points);
  const double per_part_m2 = noise * seen / weight;  // noise of a part's mean
  const double measured_m2 = (between / freedom - noise) * seen / weight;
  // Variances of the measured and of the expected one.
  const double total_m2 = expected_m2 + per_part_m2;
  const double measured_m4 = 2 / freedom * total_m2 * total_m2,
               expected_m4 = expected_m2 * expected_m2;
  if (!(measured_m4 + expected_m4 > 0)) return 0;
  return std::max(
      0., (measured_m4 * expected_m2 + expected_m4 * measured_m2) / (measured_m4 + expected_m4));
}

}  // namespace groundray
