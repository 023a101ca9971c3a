#include "reconstruction/dem/fusion/bent_plane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/ext/scalar_constants.hpp>

#include "core/random.h"

namespace groundray::bent_plane_test {
namespace {

constexpr glm::dvec2 step_m(0.25, -0.5);
constexpr double sd_m = 0.01;
constexpr SurfaceBend unknown_bend{1, 1, 1};  // variances far above what the points leave open

double normal(std::uint32_t what, std::uint32_t i) {
  return random_normal({.seed = Seed{41}, .frame = what, .pulse = i}).x;
}

// Points all over a cell, with the same noise. Heights are those of `ground`, a function of the
// position in cells.
template <typename Ground>
CellColumns points_on(const Ground& ground, std::uint32_t trial, std::size_t count,
                      double noise_m) {
  CellColumns points;
  points.count = count;
  points.padded = whole_lanes(count);
  for (auto* const column :
       {&points.x_m, &points.y_m, &points.z_m, &points.weight, &points.variance_m2})
    column->assign(points.padded, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec2 p = random_uniform({.seed = Seed{42}, .frame = trial, .pulse = i}) - 0.5;
    points.x_m[i] = static_cast<float>(p.x * step_m.x);
    points.y_m[i] = static_cast<float>(p.y * step_m.y);
    points.z_m[i] = static_cast<float>(ground(p) + noise_m * normal(trial, i));
    points.variance_m2[i] = static_cast<float>(sd_m * sd_m);
    points.weight[i] = 1 / points.variance_m2[i];
  }
  return points;
}

double bent_height(glm::dvec2 p) {
  return 0.3 + 0.1 * p.x - 0.05 * p.y + 0.04 * curvature_profile(p.x) - 0.03 * p.x * p.y +
         0.02 * curvature_profile(p.y);
}

TEST(BentPlane, ReproducesABentPlane) {
  const CellColumns points = points_on(bent_height, 0, 200, 0);
  const SurfacePlane about{.height_m = 0.2, .slope_x = 0.1, .slope_y = 0};
  const BentPlane got = fit_bent_plane(points, about, {}, unknown_bend, step_m);
  const QuadricTerms expected{0.1, 0.1 - 0.1 * step_m.x, -0.05, 0.04, -0.03, 0.02};
  // Sums of 200 floats; the bend is the least well-conditioned.
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(got.terms[k], expected[k], 2e-5);
  EXPECT_NEAR(got.fitted, 6, 0.01);
}

TEST(BentPlane, IsAPlaneIfNoBendIsExpected) {
  const CellColumns points = points_on(bent_height, 0, 200, 0);
  const BentPlane got = fit_bent_plane(points, {}, {}, {}, step_m);
  for (const std::size_t bend : {3, 4, 5}) EXPECT_NEAR(got.terms[bend], 0, 1e-6);
  EXPECT_NEAR(got.fitted, 3, 1e-3);
}

// Slopes that neighbours know exactly leave only the height to the points: their mean.
TEST(BentPlane, TakesKnownSlopesFromTheNeighbours) {
  const CellColumns points = points_on([](glm::dvec2 p) { return 0.5 * p.x; }, 0, 40, 0);
  NeighbourSurface neighbours;
  neighbours.plane = {.height_m = 0, .slope_x = 0.2, .slope_y = -0.1};
  neighbours.information_xx = neighbours.information_yy = 1e9;
  const BentPlane got = fit_bent_plane(points, {}, neighbours, {}, step_m);
  double mean = 0;
  for (std::size_t i = 0; i < points.count; ++i)
    mean += double{points.z_m[i]} - 0.2 * points.x_m[i] + 0.1 * points.y_m[i];
  EXPECT_NEAR(got.terms[0], mean / 40, 1e-5);
  EXPECT_NEAR(got.terms[1], 0.2 * step_m.x, 1e-4);
  EXPECT_NEAR(got.terms[2], -0.1 * step_m.y, 1e-4);
  EXPECT_NEAR(got.fitted, 1, 1e-2);
}

// The variance over 2000 trials has a standard deviation of 3.2 %.
TEST(BentPlane, CovarianceIsThatOfTheNoise) {
  constexpr std::uint32_t trials = 2000;
  double height = 0, bend = 0, stated_height = 0, stated_bend = 0;
  for (std::uint32_t trial = 0; trial < trials; ++trial) {
    const BentPlane got =
        fit_bent_plane(points_on(bent_height, trial, 60, sd_m), {}, {}, unknown_bend, step_m);
    height += std::pow(got.terms[0] - 0.3, 2) / trials;
    bend += std::pow(got.terms[3] - 0.04, 2) / trials;
    stated_height += got.covariance[0][0] / trials;
    stated_bend += got.covariance[3][3] / trials;
  }
  EXPECT_NEAR(height / stated_height, 1, 0.13);
  EXPECT_NEAR(bend / stated_bend, 1, 0.13);
}

TEST(BentPlane, PointsAlongLinesAreNotThroughoutACell) {
  CellColumns points = points_on(bent_height, 0, 60, 0);
  EXPECT_TRUE(has_points_throughout(points, step_m));
  EXPECT_FALSE(has_points_throughout(points_on(bent_height, 0, 31, 0), step_m));
  CellColumns outliers = points;
  for (std::size_t i = 31; i < points.count; ++i) outliers.weight[i] = 0;
  EXPECT_FALSE(has_points_throughout(outliers, step_m));
  for (std::size_t i = 0; i < points.count; ++i) {
    points.x_m[i] = static_cast<float>((i % 2 == 0 ? 0.3 : -0.2) * step_m.x);  // 2 of 4 columns
  }
  EXPECT_FALSE(has_points_throughout(points, step_m));
}

// Sets the stated noise of the points.
void state_noise(CellColumns& points, double noise_m) {
  for (std::size_t i = 0; i < points.count; ++i) {
    points.variance_m2[i] = static_cast<float>(noise_m * noise_m);
    points.weight[i] = 1 / points.variance_m2[i];
  }
}

// Ground of the variance 1 mm² in waves that are longer than a part of the cell, whose means over
// parts have (sin(pi / 4) / (pi / 4))² = 0.81 of it. The noise of a part's mean, of ten points,
// decides how far that counts against the expected variance: a blend by the inverse variances
// (e + n)² / 8 of the measured variance and e² of the expected one. The measured one is known to
// (0.81 + n) / sqrt(8 * 400), of which five standard errors are allowed.
TEST(BentPlane, ScatterIsThatOfTheGroundUnlessNoiseHidesIt) {
  for (const double noise_mm : {0.5, 2., 10.}) {
    for (const double expected_mm2 : {0.25, 4.}) {
      double sum_m2 = 0;
      constexpr std::uint32_t trials = 400;
      for (std::uint32_t trial = 0; trial < trials; ++trial) {
        const double phase = 2 * glm::pi<double>() * trial / trials;
        const auto wave = [phase](glm::dvec2 p) {
          return 1e-3 * std::sqrt(2.0) * std::sin(2 * glm::pi<double>() * p.x + phase);
        };
        CellColumns points = points_on(wave, trial, 160, 1e-3 * noise_mm);
        state_noise(points, 1e-3 * noise_mm);
        sum_m2 += scatter_m2(points, {}, 0, 1e-6 * expected_mm2, step_m) / trials;
      }
      const double own_mm2 = noise_mm * noise_mm / 10, square = expected_mm2 * expected_mm2;
      const double share = square / (square + std::pow(expected_mm2 + own_mm2, 2) / 8);
      EXPECT_NEAR(1e6 * sum_m2, share * 0.81 + (1 - share) * expected_mm2,
                  0.02 * expected_mm2 + share * (0.03 + 5 * (0.81 + own_mm2) / std::sqrt(3200)))
          << noise_mm << " mm, " << expected_mm2 << " mm²";
    }
  }
}

// Weights are smaller than 1 / variance where points have a bias in common.
TEST(BentPlane, ScatterDoesNotDependOnTheScaleOfWeights) {
  CellColumns points =
      points_on([](glm::dvec2 p) { return 2e-3 * std::sin(9 * p.x); }, 0, 160, 0.002);
  state_noise(points, 0.002);
  const double whole_m2 = scatter_m2(points, {}, 0, 1e-6, step_m);
  EXPECT_GT(whole_m2, 1.05e-6);
  for (float& weight : points.weight) weight /= 61;
  EXPECT_NEAR(scatter_m2(points, {}, 0, 1e-6, step_m), whole_m2, 1e-5 * whole_m2);
}

// Noise that is three times larger than stated is not taken for ground: the mean of a part is off
// by 3 mm.
TEST(BentPlane, NoiseIsNotScatterOfTheGround) {
  double sum_m2 = 0;
  for (std::uint32_t trial = 0; trial < 400; ++trial) {
    CellColumns points = points_on([](glm::dvec2) { return 0.0; }, trial, 160, sd_m);
    state_noise(points, sd_m / 3);
    sum_m2 += scatter_m2(points, {}, 0, 1e-6, step_m) / 400;
  }
  EXPECT_LT(sum_m2, 1.5e-6);
}

// One exact point in a corner of a wide cell: the rounding of 1e8 times its squares exceeds the
// information on the slopes, which alone determines these.
TEST(BentPlane, RoundingTakesNoInformationFromTheNeighbours) {
  constexpr glm::dvec2 wide_m(5, 5);
  CellColumns points = points_on([](glm::dvec2) { return 0.0; }, 0, 1, 0);
  points.x_m[0] = points.y_m[0] = 0.45F * 5;
  points.z_m[0] = 0.7F;
  points.weight[0] = 1e8F;
  NeighbourSurface neighbours;
  neighbours.information_xx = neighbours.information_yy = 1;
  const BentPlane got = fit_bent_plane(points, {}, neighbours, {}, wide_m);
  const double slope_variance = got.covariance[1][1] / (wide_m.x * wide_m.x);
  EXPECT_GT(slope_variance, 0.3);
  EXPECT_LT(slope_variance, 1.01);
  EXPECT_NEAR(got.covariance[0][0], 2 * std::pow(0.45 * 5, 2), 1);
}

}  // namespace
}  // namespace groundray::bent_plane_test
