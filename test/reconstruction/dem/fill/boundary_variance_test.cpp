#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "reconstruction/dem/fill/dem_fill.h"

namespace groundray::boundary_variance_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Columns from `first` to before `end` are filled, all others measured.
DemLayers with_gap(glm::ivec2 samples, int first, int end, float fill_sd_m) {
  DemLayers layers = unknown_layers({.samples = samples});
  for (std::size_t i = 0; i < layers.source.size(); ++i) {
    const int column = static_cast<int>(i) % samples.x;
    const bool is_filled = first <= column && column < end;
    layers.source[i] = is_filled ? HeightSource::Filled : HeightSource::Lidar;
    layers.elevation_m[i] = 0;
    layers.variance_m2[i] = is_filled ? nan : 0;
    layers.fill_sd_m[i] = is_filled ? fill_sd_m : nan;
  }
  return layers;
}

// Each half of the gap gets the variance of its own side.
TEST(BoundaryVariance, AddsTheVarianceOfTheNearerSide) {
  const glm::ivec2 samples(20, 9);
  DemLayers layers = with_gap(samples, 6, 14, 0.3f);
  for (std::size_t i = 0; i < layers.source.size(); ++i) {
    if (layers.source[i] == HeightSource::Filled) continue;
    layers.variance_m2[i] = i % 20 < 10 ? 0.16f : 1.44f;  // of standard deviations of 0.4 and 1.2 m
  }
  add_boundary_variance(layers);
  for (std::size_t i = 0; i < layers.source.size(); ++i) {
    const std::size_t column = i % 20;
    if (layers.source[i] != HeightSource::Filled) {
      EXPECT_TRUE(std::isnan(layers.fill_sd_m[i]));
    } else {
      EXPECT_NEAR(layers.fill_sd_m[i], column < 10 ? 0.5 : std::sqrt(0.09 + 1.44), 1e-6) << column;
    }
  }
}

// Nearest of scattered samples, by exhaustive search: sweeps may miss it by a part of a cell.
TEST(BoundaryVariance, AddsTheVarianceOfTheNearestScatteredSample) {
  const glm::ivec2 samples(61, 47);
  DemLayers layers = with_gap(samples, 0, 61, 0);
  layers.frame.step_m = {0.5, -2};
  std::mt19937 random(3);
  std::vector<std::size_t> measured;
  for (int k = 0; k < 12; ++k) {
    // No two within two rows and columns, which would be averaged.
    const std::size_t i = 61 * (6 * (random() % 8)) + 6 * (random() % 11);
    layers.source[i] = HeightSource::Stereo;
    layers.variance_m2[i] = static_cast<float>(k + 1);  // identifies the sample
    layers.fill_sd_m[i] = nan;
    measured.push_back(i);
  }
  const auto distance_m = [&](std::size_t a, std::size_t b) {
    const auto x = static_cast<double>(a % 61) - static_cast<double>(b % 61);
    const std::size_t row_a = a / 61, row_b = b / 61;
    const double y = static_cast<double>(row_a) - static_cast<double>(row_b);
    return std::hypot(0.5 * x, 2 * y);
  };
  add_boundary_variance(layers);
  for (std::size_t i = 0; i < layers.source.size(); ++i) {
    if (layers.source[i] != HeightSource::Filled) continue;
    double least_m = 1e9, taken_m = 1e9;
    const double variance_m2 = static_cast<double>(layers.fill_sd_m[i]) * layers.fill_sd_m[i];
    for (const std::size_t at : measured) {
      least_m = std::min(least_m, distance_m(i, at));
      if (std::abs(variance_m2 - layers.variance_m2[at]) < 1e-3)
        taken_m = std::min(taken_m, distance_m(i, at));
    }
    EXPECT_LE(taken_m, least_m + 0.5) << i;
  }
}

// All data share one error of 0.2 m, as in a survey with wrong poses.
TEST(BoundaryVariance, StatedSdsCoverAnErrorSharedByAllData) {
  constexpr double bias_m = 0.2, fill_m = 0.02;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  double sum = 0;
  constexpr int trials = 2000;
  DemLayers layers = with_gap({9, 9}, 3, 6, static_cast<float>(fill_m));
  for (std::size_t i = 0; i < layers.source.size(); ++i) {
    if (layers.source[i] != HeightSource::Filled)
      layers.variance_m2[i] = static_cast<float>(bias_m * bias_m);
  }
  add_boundary_variance(layers);
  for (int trial = 0; trial < trials; ++trial) {
    const double error_m = bias_m * normal(random) + fill_m * normal(random);
    const double z = error_m / static_cast<double>(layers.fill_sd_m[40]);
    sum += z * z;
  }
  // The mean of z^2 scatters by sqrt(2 / 2000) = 0.032; four times that.
  EXPECT_NEAR(sum / trials, 1, 0.13);
}

TEST(BoundaryVariance, KeepsSdsWithoutMeasuredSamples) {
  DemLayers layers = with_gap({4, 4}, 0, 4, 0.1f);
  layers.fill_sd_m[3] = nan;
  add_boundary_variance(layers);
  EXPECT_EQ(layers.fill_sd_m[0], 0.1f);
  EXPECT_TRUE(std::isnan(layers.fill_sd_m[3]));
}

}  // namespace
}  // namespace groundray::boundary_variance_test
