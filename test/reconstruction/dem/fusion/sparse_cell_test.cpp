#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "core/random.h"
#include "reconstruction/dem/fusion/cell_columns.h"

namespace groundray::sparse_cell_test {
namespace {

constexpr glm::dvec2 step_m(0.5, 0.25);

double normal(std::uint32_t what, std::uint32_t i) {
  return random_normal({.seed = Seed{21}, .frame = what, .pulse = i}).x;
}
glm::dvec2 uniform(std::uint32_t what, std::uint32_t i) {
  return random_uniform({.seed = Seed{22}, .frame = what, .pulse = i});
}

NeighbourSurface surface() {
  NeighbourSurface known;
  known.cells = 24;
  known.height_variance_m2 = 0.02 * 0.02;
  known.xx = 0.05 * 0.05;
  known.yy = 0.08 * 0.08;
  return known;
}

// A point with no outlier probability: the result is the weighted mean of the surface and the
// point.
TEST(SparseCells, OnePointIsAveragedWithTheSurfaceByWeight) {
  const NeighbourSurface known = surface();
  std::array<SparseCell, 2> points{};
  points[0] = {.above_m = 0.03, .variance_m2 = 0.01 * 0.01};
  const FewHeight got = fit_few(points, 1, known, step_m, 1e-12);
  const double gain = 4e-4 / (4e-4 + 1e-4);
  EXPECT_NEAR(got.above_m, gain * 0.03, 1e-9);
  EXPECT_NEAR(got.variance_m2, 4e-4 * (1 - gain), 1e-12);
  EXPECT_NEAR(got.is_ground[0], 1, 1e-6);
  EXPECT_LT(got.is_none, 1e-6);
}

// Bayes' rule by hand: a normal density against the density of outliers.
TEST(SparseCells, OutlierProbabilityFollowsBayesRule) {
  const NeighbourSurface known = surface();
  constexpr double outliers_per_m = 0.01, pi = 3.14159265358979323846;
  for (const double above_m : {0.0, 0.05, 0.08, 0.2, 2.0}) {
    std::array<SparseCell, 2> points{};
    points[0] = {.above_m = above_m, .variance_m2 = 1e-4};
    const FewHeight got = fit_few(points, 1, known, step_m, outliers_per_m);
    const double variance_m2 = 5e-4;
    const double density =
        std::exp(-0.5 * above_m * above_m / variance_m2) / std::sqrt(2 * pi * variance_m2);
    EXPECT_NEAR(got.is_none, outliers_per_m / (outliers_per_m + density), 1e-9);
    EXPECT_NEAR(got.is_none + got.is_ground[0], 1, 1e-12);
  }
}

// Ground, points and outliers are drawn from the model. 4 x 10^4 draws determine the RMS of
// normalised errors to 0.4 %; outliers mistaken for ground lengthen the tails: 5 %.
TEST(SparseCells, StatedErrorsAreCorrect) {
  const NeighbourSurface known = surface();
  constexpr double share = 0.05, reach_m = 2;
  double sum = 0, off_m = 0;
  constexpr std::uint32_t draws = 40000;
  for (std::uint32_t i = 0; i < draws; ++i) {
    const double ground_m = std::sqrt(known.height_variance_m2) * normal(1, i);
    const double slope_x = std::sqrt(known.xx) * normal(2, i);
    const double slope_y = std::sqrt(known.yy) * normal(3, i);
    std::array<SparseCell, 2> points{};
    for (std::uint32_t k = 0; k < 2; ++k) {
      const glm::dvec2 place_m = (uniform(4 + k, i) - 0.5) * step_m, dice = uniform(6 + k, i);
      const double sd_m = 0.01 + 0.02 * uniform(8 + k, i).x;
      const double true_m = ground_m + slope_x * place_m.x + slope_y * place_m.y;
      const double above_m =
          dice.x < share ? reach_m * (dice.y - 0.5) : true_m + sd_m * normal(10 + k, i);
      points[k] = {.place_m = place_m, .above_m = above_m, .variance_m2 = sd_m * sd_m, .group = k};
    }
    const FewHeight got =
        fit_few(points, 1 + static_cast<int>(i % 2), known, step_m, share / reach_m);
    sum += std::pow(got.above_m - ground_m, 2) / got.variance_m2;
    off_m += got.above_m - ground_m;
  }
  EXPECT_NEAR(std::sqrt(sum / draws), 1, 0.05);
  EXPECT_NEAR(off_m / draws, 0, 4 * 0.015 / std::sqrt(draws));
}

// Points of the surface's own group carry no information about their common bias.
TEST(SparseCells, BiasSharedByTheSurfaceAndAPointRemains) {
  NeighbourSurface known = surface();
  known.group = 7;
  known.bias_m = 0.03;
  std::array<SparseCell, 2> points{};
  points[0] = {.above_m = 0, .variance_m2 = 1e-4, .bias_m = 0.03, .group = 7};
  const FewHeight same = fit_few(points, 1, known, step_m, 1e-12);
  EXPECT_NEAR(same.variance_m2, 4e-4 * 1e-4 / 5e-4 + 9e-4, 1e-9);
  points[0].group = 8;
  const FewHeight other = fit_few(points, 1, known, step_m, 1e-12);
  const double surface_m2 = 4e-4 + 9e-4, point_m2 = 1e-4 + 9e-4;
  EXPECT_NEAR(other.variance_m2, surface_m2 * point_m2 / (surface_m2 + point_m2), 1e-9);
}

}  // namespace
}  // namespace groundray::sparse_cell_test
