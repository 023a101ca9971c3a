#include "reconstruction/dem/smooth/dem_smooth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace groundray::dem_smooth_test {
namespace {

using ::testing::HasSubstr;

constexpr float none = std::numeric_limits<float>::quiet_NaN();
constexpr glm::ivec2 size(48, 40);

// Row-major index of a raster's sample.
std::size_t index_of(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

GridFrame frame_of(glm::dvec2 step_m = {1, -1}) {
  return {.samples = size, .origin_m = {5, 7}, .step_m = step_m, .cells_per_m = 1.0 / step_m};
}

std::vector<float> sampled(const std::function<double(int, int)>& height_m) {
  std::vector<float> heights_m;
  for (int row = 0; row < size.y; ++row)
    for (int column = 0; column < size.x; ++column)
      heights_m.push_back(static_cast<float>(height_m(column, row)));
  return heights_m;
}

std::vector<float> with_noise(std::vector<float> heights_m, double sd_m, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, static_cast<float>(sd_m));
  for (float& z : heights_m) z += noise(random);
  return heights_m;
}

// Half of the derivative of the functional that smoothing minimises, by its definition, with
// respect to each height, times that height's standard deviation; and the largest effect of
// rounding heights to floats on it.
struct Slope {
  std::vector<double> by_height, rounding;
};

Slope slope_of(const std::vector<float>& z, const std::vector<float>& measured_m,
               const std::vector<float>& variance_m2, glm::dvec2 step_m, double k) {
  Slope slope{std::vector<double>(z.size(), 0), std::vector<double>(z.size(), 0)};
  const auto rounded = [&](std::size_t i) { return std::abs(double{z[i]}) * 0x1p-24; };
  const auto sd = [&](std::size_t i) { return std::sqrt(double{variance_m2[i]}); };
  for (std::size_t i = 0; i < z.size(); ++i) {
    if (std::isnan(z[i])) continue;
    slope.by_height[i] += (double{z[i]} - double{measured_m[i]}) / sd(i);
    slope.rounding[i] += rounded(i) / sd(i);
  }
  // sqrt(1 + D^2 / k^2) has the derivative D / k^2 / sqrt(1 + D^2 / k^2), whose slope is at most 1
  // / k^2.
  const auto bend = [&](const std::vector<std::pair<std::size_t, double>>& terms, double weight) {
    double derivative = 0, reach = 0;
    for (const auto& [i, factor] : terms) {
      derivative += factor * double{z[i]};
      reach += std::abs(factor) * rounded(i);
    }
    if (std::isnan(derivative)) return;
    const double flat = std::sqrt(1 + weight * derivative * derivative / (k * k));
    for (const auto& [i, factor] : terms) {
      slope.by_height[i] += weight * derivative / (k * k) / flat * factor * sd(i);
      slope.rounding[i] += weight * reach / (k * k) * std::abs(factor) * sd(i);
    }
  };
  const double xx = 1 / (step_m.x * step_m.x), yy = 1 / (step_m.y * step_m.y);
  const double xy = 1 / (step_m.x * step_m.y);
  const auto at = [](int c, int r) { return index_of(c, r, size.x); };
  for (int r = 0; r < size.y; ++r) {
    for (int c = 0; c < size.x; ++c) {
      if (c + 2 < size.x) bend({{at(c, r), xx}, {at(c + 1, r), -2 * xx}, {at(c + 2, r), xx}}, 1);
      if (r + 2 < size.y) bend({{at(c, r), yy}, {at(c, r + 1), -2 * yy}, {at(c, r + 2), yy}}, 1);
      if (c + 1 < size.x && r + 1 < size.y) {
        bend({{at(c, r), xy}, {at(c + 1, r), -xy}, {at(c, r + 1), -xy}, {at(c + 1, r + 1), xy}},
             2);  // z_xy and z_yx
      }
    }
  }
  return slope;
}

double rms_m(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(a[i]) || std::isnan(b[i])) continue;
    sum += std::pow(a[i] - b[i], 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

// The functional is convex, so it is minimal where its derivative is 0. A curvature sd that is 1.1
// times as large, a mixed term counted once, or only three rounds leave 50 times the permitted
// residual.
TEST(DemSmooth, MinimisesNoiseAndCurvature) {
  constexpr double sd_m = 0.1, k = 0.02;
  for (const glm::dvec2 step_m : {glm::dvec2(1, -2), glm::dvec2(1.5, 1)}) {
    auto measured_m = with_noise(
        sampled([](int c, int r) { return std::sin(c / 8.0) + (r > 20 ? 3 : 0); }), sd_m, 1);
    std::vector<float> variance_m2(measured_m.size(), 0.01f);
    for (std::size_t i = 7; i < measured_m.size(); i += 11) measured_m[i] = none;
    for (std::size_t i = 3; i < measured_m.size(); i += 13) variance_m2[i] = 0.04f;
    for (std::size_t i = 5; i < measured_m.size(); i += 17) variance_m2[i] = 1e-4f;
    const SmoothHeights found = smooth_dem(frame_of(step_m), measured_m, variance_m2,
                                           {.curvature_sd_per_m = k, .most_rounds = 1000});
    EXPECT_LT(found.rounds, 1000U);
    RecordProperty("rounds", static_cast<int>(found.rounds));
    const Slope slope = slope_of(found.heights_m, measured_m, variance_m2, step_m, k);
    for (std::size_t i = 0; i < measured_m.size(); ++i) {
      ASSERT_EQ(std::isnan(found.heights_m[i]), std::isnan(measured_m[i]));
      EXPECT_NEAR(slope.by_height[i], 0, 1e-3 + slope.rounding[i]) << i;  // 1e-3: documented
    }
  }
}

TEST(DemSmooth, RemovesNoiseAndKeepsEdges) {
  constexpr double sd_m = 0.05, variance_m2 = sd_m * sd_m, k = 0.02;
  std::vector<double> lost_m;
  for (const double edge_m : {2.0, 20.0}) {
    const auto truth_m = sampled(
        [&](int c, int r) { return 0.3 * std::sin(c / 9.0) + r / 20.0 + (c > 24 ? edge_m : 0); });
    const auto measured_m = with_noise(truth_m, sd_m, 3);
    const std::vector<float> variances_m2(measured_m.size(), static_cast<float>(variance_m2));
    // Smoothing removes at least half of the noise's variance, as if each height were the mean of
    // two.
    EXPECT_LT(rms_m(smooth_dem(frame_of(), measured_m, variances_m2).heights_m, truth_m),
              std::sqrt(0.5) * rms_m(measured_m, truth_m));
    const auto found_m =
        smooth_dem(frame_of(), measured_m, variances_m2, {.curvature_sd_per_m = k}).heights_m;
    // No second derivative pulls by more than its factor / k; a height takes part in three along
    // its row, three along its column (factors 1, 2, 1) and four mixed ones (root of 2). The last
    // term covers the largest residual, 1e-3 sds.
    const double most_m = variance_m2 / k * (4 + 4 + 4 * std::sqrt(2.0)) + 1e-3;
    for (std::size_t i = 0; i < found_m.size(); ++i)
      EXPECT_LT(std::abs(found_m[i] - measured_m[i]), most_m);
    double sum_m = 0;
    for (int row = 0; row < size.y; ++row) {
      const auto at = index_of(24, row, size.x);
      sum_m += measured_m[at + 1] - measured_m[at] - (found_m[at + 1] - found_m[at]);
    }
    lost_m.push_back(sum_m / size.y);
  }
  // The pull at an edge does not grow with the edge's height: its derivatives D pull by 1 / k, less
  // k^2 / (2 D^2) of that, which is 5e-5 of most_m at 2 m; the remainder is the solver's residual.
  EXPECT_NEAR(lost_m[0], lost_m[1], 5e-4);
  EXPECT_GT(lost_m[0], 0);
}

TEST(DemSmooth, UnmeasuredSamplesStayUnmeasuredAndHaveNoInfluence) {
  auto measured_m = with_noise(sampled([](int c, int r) { return c * 0.1 + r * 0.05; }), 0.1, 4);
  std::vector<float> variance_m2(measured_m.size(), 0.01f);
  auto other_m = measured_m;
  for (std::size_t i = 500; i < 560; ++i) {
    variance_m2[i] = none;
    other_m[i] = i % 2 == 0 ? 1000 : none;  // as if it had been filled
  }
  const auto one = smooth_dem(frame_of(), measured_m, variance_m2).heights_m;
  const auto two = smooth_dem(frame_of(), other_m, variance_m2).heights_m;
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(std::isnan(one[i]), i >= 500 && i < 560);
    if (!std::isnan(one[i])) {
      EXPECT_EQ(one[i], two[i]);
    }
  }
}

// A sample without neighbours takes part in no second derivative. Inserting it into a sparse matrix
// would move all later entries, which takes 20 times as long per sample of this raster.
TEST(DemSmooth, IsolatedSamplesTakeNoLonger) {
  const auto seconds_per_sample = [](bool is_lone) {
    constexpr int side = 400;
    const GridFrame frame{.samples = {side, side}};
    std::vector<float> heights_m(std::size_t{side} * side, none);
    double count = 0;
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        if (is_lone && row < side / 2 && (row % 3 != 0 || column % 3 != 0)) continue;
        heights_m[index_of(column, row, side)] = static_cast<float>(row % 7 + column % 5);
        ++count;
      }
    }
    const auto start = std::chrono::steady_clock::now();
    (void)smooth_dem(frame, heights_m, std::vector<float>(heights_m.size(), 1), {.most_rounds = 1});
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    return taken.count() / count;
  };
  EXPECT_LT(seconds_per_sample(true), 6 * seconds_per_sample(false));
}

// 1 / k^2 exceeds the range of doubles.
TEST(DemSmooth, ReportsUnsolvableEquations) {
  const auto measured_m = with_noise(sampled([](int c, int) { return c * 0.1; }), 0.1, 5);
  const std::vector<float> variance_m2(measured_m.size(), 0.01f);
  try {
    (void)smooth_dem(frame_of(), measured_m, variance_m2, {.curvature_sd_per_m = 1e-160});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("curvature_sd_per_m = 1e-160"));
  }
}

// Variances that differ by 10^10: the right-hand side of the equations must not be judged
// by that of the samples with the smallest sd.
TEST(DemSmooth, ConvergesForVariancesOfVeryDifferentSizes) {
  const glm::dvec2 step_m(1, -1);
  const auto measured_m =
      with_noise(sampled([](int c, int r) { return std::sin(c / 8.0) * r / 9.0; }), 0.1, 6);
  std::vector<float> variance_m2;
  for (std::size_t i = 0; i < measured_m.size(); ++i)
    variance_m2.push_back(std::pow(10.0f, static_cast<float>(i * 7 % 11) - 7));
  const SmoothHeights found = smooth_dem(frame_of(step_m), measured_m, variance_m2,
                                         {.curvature_sd_per_m = 0.05, .most_rounds = 1000});
  EXPECT_LT(found.rounds, 1000U);
  const Slope slope = slope_of(found.heights_m, measured_m, variance_m2, step_m, 0.05);
  for (std::size_t i = 0; i < measured_m.size(); ++i)
    EXPECT_NEAR(slope.by_height[i], 0, 1e-3 + slope.rounding[i]) << i;
}

TEST(DemSmooth, KeepsPlanes) {
  const auto plane_m = sampled([](int c, int r) { return 100 + c * 0.25 - r * 0.5; });
  const auto found =
      smooth_dem(frame_of(), plane_m, std::vector<float>(plane_m.size(), 1)).heights_m;
  // Quarters of a metre are exact in floats, and no term pulls.
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], plane_m[i]);
}

TEST(DemSmooth, AcceptsSparseRastersAndRejectsInvalidOnes) {
  std::vector<float> heights_m(static_cast<std::size_t>(size.x * size.y), none);
  std::vector<float> variance_m2(heights_m.size(), 1);
  EXPECT_NO_THROW((void)smooth_dem(frame_of(), heights_m, variance_m2));
  heights_m[77] = 5;
  EXPECT_EQ(smooth_dem(frame_of(), heights_m, variance_m2).heights_m[77], 5);
  variance_m2[3] = 0;
  heights_m[4] = INFINITY;
  try {
    (void)smooth_dem(frame_of(), heights_m, variance_m2, {.curvature_sd_per_m = -1});
    FAIL();
  } catch (const Error& error) {
    for (const char* fault : {"a variance is 0", "a height is infinite", "curvature_sd_per_m = -1"})
      EXPECT_THAT(error.what(), HasSubstr(fault));
  }
}

}  // namespace
}  // namespace groundray::dem_smooth_test
