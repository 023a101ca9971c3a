#include "reconstruction/dem/dem_smooth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "core/error.h"

namespace groundray {
namespace {

using ::testing::HasSubstr;

constexpr float none = std::numeric_limits<float>::quiet_NaN();
constexpr glm::ivec2 size(48, 40);

// The number of a sample of a raster, counted row by row.
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

// What smooth heights have the least of, by its definition.
double cost(const std::vector<double>& z, const std::vector<float>& measured_m,
            const std::vector<float>& variance_m2, glm::dvec2 step_m, double k) {
  const auto at = [&](int c, int r) { return z[index_of(c, r, size.x)]; };
  double sum = 0;
  const auto bend = [&](double derivative) {
    if (!std::isnan(derivative)) sum += 2 * (std::sqrt(1 + derivative * derivative / (k * k)) - 1);
  };
  const double dx = step_m.x, dy = step_m.y;
  for (int r = 0; r < size.y; ++r) {
    for (int c = 0; c < size.x; ++c) {
      const auto i = index_of(c, r, size.x);
      if (!std::isnan(z[i])) sum += std::pow(z[i] - measured_m[i], 2) / variance_m2[i];
      if (c + 2 < size.x) bend((at(c, r) - 2 * at(c + 1, r) + at(c + 2, r)) / (dx * dx));
      if (r + 2 < size.y) bend((at(c, r) - 2 * at(c, r + 1) + at(c, r + 2)) / (dy * dy));
      if (c + 1 < size.x && r + 1 < size.y) {
        bend(std::sqrt(2) * (at(c, r) - at(c + 1, r) - at(c, r + 1) + at(c + 1, r + 1)) /
             (dx * dy));
      }
    }
  }
  return sum;
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

TEST(DemSmooth, LeavesTheLeastOfNoiseAndCurvature) {
  constexpr double sd_m = 0.1, k = 0.02;
  const glm::dvec2 step_m(1, -2);
  auto measured_m = with_noise(
      sampled([](int c, int r) { return std::sin(c / 8.0) + (r > 20 ? 3 : 0); }), sd_m, 1);
  std::vector<float> variance_m2(measured_m.size(), 0.01f);
  for (std::size_t i = 7; i < measured_m.size(); i += 11) measured_m[i] = none;
  for (std::size_t i = 3; i < measured_m.size(); i += 13) variance_m2[i] = 0.04f;
  const SmoothHeights found = smooth_dem(frame_of(step_m), measured_m, variance_m2,
                                         {.curvature_sd_per_m = k, .most_rounds = 200});
  const std::vector<double> z(found.heights_m.begin(), found.heights_m.end());
  const double least = cost(z, measured_m, variance_m2, step_m, k);
  std::mt19937 random(2);
  std::normal_distribution<double> move(0, 1);
  for (int round = 0; round < 40; ++round) {
    // Any other surface costs more: far and near, rough and lone moves.
    std::vector<double> other = z;
    const double far_m = std::pow(10, -1 - round % 3);
    for (double& height_m : other)
      if (round % 2 == 0 || random() % 50 == 0) height_m += far_m * move(random);
    EXPECT_GT(cost(other, measured_m, variance_m2, step_m, k), least);
  }
}

TEST(DemSmooth, TakesNoiseAwayAndLeavesEdges) {
  for (const double edge_m : {2.0, 20.0}) {
    const auto truth_m = sampled(
        [&](int c, int r) { return 0.3 * std::sin(c / 9.0) + r / 20.0 + (c > 24 ? edge_m : 0); });
    const auto measured_m = with_noise(truth_m, 0.05, 3);
    const SmoothHeights found =
        smooth_dem(frame_of(), measured_m, std::vector<float>(measured_m.size(), 0.0025f));
    EXPECT_LT(rms_m(found.heights_m, truth_m), 0.7 * rms_m(measured_m, truth_m));
    // What pulls at an edge does not grow with it: some sds of the heights beside it.
    double step_m = 0;
    for (int row = 0; row < size.y; ++row) {
      const auto at = index_of(0, row, size.x);
      step_m += (found.heights_m[at + 25] - found.heights_m[at + 24]) / size.y;
    }
    EXPECT_NEAR(step_m, edge_m + 0.3 * (std::sin(25 / 9.0) - std::sin(24 / 9.0)), 0.25);
  }
}

TEST(DemSmooth, WhatWasNotMeasuredStaysSoAndHasNoInfluence) {
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

TEST(DemSmooth, LeavesPlanesAsTheyAre) {
  const auto plane_m = sampled([](int c, int r) { return 100 + c * 0.25 - r * 0.5; });
  const auto found =
      smooth_dem(frame_of(), plane_m, std::vector<float>(plane_m.size(), 1)).heights_m;
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], plane_m[i], 1e-4);
}

TEST(DemSmooth, TakesOddRastersAndRefusesWhatIsNoDem) {
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
}  // namespace groundray
