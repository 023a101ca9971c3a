#include "reconstruction/pipeline/dem_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace groundray::dem_truth_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double rounding_m = 2e-6;  // single precision at some 10 m

double true_height_m(glm::dvec2 p_w_m) { return 12 + 0.5 * p_w_m.x - 0.25 * p_w_m.y; }

// A plane over [0, 40] x [0, 30] m in W, which triangles of any size represent exactly. Its D has
// another origin.
Dem plane() {
  const glm::dvec3 origin_w_m(8, -4, 5);
  std::vector<float> heights_m;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column)
      heights_m.push_back(
          static_cast<float>(true_height_m({10 * column, 30 - 10 * row}) - origin_w_m.z));
  }
  return {.grid = HeightGrid({5, 4}, {-8, 34}, {10, -10}, heights_m),
          .origin_w_m = origin_w_m,
          .crs_wkt = "",
          .crs_name = ""};
}

// Heights with a given error against the plane at each sample, in a D of their own.
struct Rebuilt {
  Georeference georeference{.origin_w_m = {3, 2, 0}};
  DemLayers layers = unknown_layers(
      {.samples = {10, 4}, .origin_m = {0, 20}, .step_m = {2, -2}, .cells_per_m = {0.5, -0.5}});

  void set(std::size_t i, double error_m, HeightSource source, double sd_m) {
    const glm::ivec2 at(static_cast<int>(i) % 10, static_cast<int>(i) / 10);
    const glm::dvec2 p_w_m = layers.frame.to_D(at) + glm::dvec2(georeference.origin_w_m);
    layers.elevation_m[i] = static_cast<float>(true_height_m(p_w_m) + error_m);
    layers.source[i] = source;
    if (source == HeightSource::Filled)
      layers.fill_sd_m[i] = static_cast<float>(sd_m);
    else
      layers.variance_m2[i] = static_cast<float>(sd_m * sd_m);
  }
};

// Twenty errors of 1 to 20 mm. Their squares sum to 2870 mm². The median is 10.5 mm, and the
// distances to it are 0.5, 0.5, 1.5, 1.5, ... 9.5, 9.5 mm; 95 % are 19 errors.
TEST(DemTruth, MatchesStatisticsOfKnownErrors) {
  Rebuilt rebuilt;
  for (std::size_t i = 0; i < 20; ++i)
    rebuilt.set(i, 1e-3 * static_cast<double>(20 - i), HeightSource::Lidar, 0.0105);
  const TruthComparison found = compare_with_truth(rebuilt.layers, rebuilt.georeference, plane());
  ASSERT_EQ(found.errors.size(), 5U);
  for (const std::size_t k : {0, 1}) {
    const HeightErrors& e = found.errors[k];
    EXPECT_EQ(e.of, k == 0 ? "measured" : "lidar");
    EXPECT_EQ(e.samples, 20U);
    EXPECT_NEAR(e.bias_m, 0.0105, rounding_m);
    EXPECT_NEAR(e.rmse_m, 1e-3 * std::sqrt(2870. / 20), rounding_m);
    EXPECT_NEAR(e.nmad_m, 1.4826 * 0.005, 2 * rounding_m);
    EXPECT_NEAR(e.p95_m, 0.019, rounding_m);
    EXPECT_NEAR(e.largest_m, 0.020, rounding_m);
    EXPECT_EQ(e.stated, 20U);
    EXPECT_NEAR(e.normalised_rms, std::sqrt(2870. / 20) / 10.5, 1e-3);
    // The middle squares are 10² and 11² mm²; half of all normal errors are within 0.67449 sd.
    EXPECT_NEAR(e.normalised_robust, std::sqrt((100. + 121) / 2) / 10.5 / 0.67449, 1e-3);
    EXPECT_EQ(e.within_1sd, 0.5);
    EXPECT_EQ(e.within_2sd, 1);
  }
  EXPECT_NEAR(found.error_m[0], 0.020, rounding_m);
  EXPECT_NEAR(found.normalised[0], 20 / 10.5, 1e-3);
  EXPECT_TRUE(std::isnan(found.error_m[20]));
}

// 95 % of 21 are 19.95, so the twentieth is the smallest value that so many do not exceed.
TEST(DemTruth, P95IsTheSmallestErrorThat95PercentDoNotExceed) {
  Rebuilt rebuilt;
  for (std::size_t i = 0; i < 21; ++i)
    rebuilt.set(i, (i % 2 == 0 ? 1e-3 : -1e-3) * static_cast<double>(i + 1), HeightSource::Stereo,
                0.01);
  const auto found = compare_with_truth(rebuilt.layers, rebuilt.georeference, plane()).errors;
  EXPECT_EQ(found[2].of, "stereo");
  EXPECT_NEAR(found[2].p95_m, 0.020, rounding_m);
  EXPECT_NEAR(found[2].largest_m, 0.021, rounding_m);
  EXPECT_NEAR(found[2].bias_m, 0.011 / 21, rounding_m);
}

TEST(DemTruth, SeparatesSources) {
  Rebuilt rebuilt;
  rebuilt.set(0, 0.1, HeightSource::Lidar, 0.1);
  rebuilt.set(1, -0.2, HeightSource::Stereo, 0.1);
  rebuilt.set(2, 0.3, HeightSource::Fused, 0);  // no standard deviation is stated
  rebuilt.set(3, 0.4, HeightSource::Filled, 0.2);
  rebuilt.set(4, 0.5, HeightSource::Filled, nan);
  const TruthComparison found = compare_with_truth(rebuilt.layers, rebuilt.georeference, plane());
  const char* names[] = {"measured", "lidar", "stereo", "fused", "filled"};
  const std::size_t samples[] = {3, 1, 1, 1, 2}, stated[] = {2, 1, 1, 0, 1};
  const double largest_m[] = {0.3, 0.1, 0.2, 0.3, 0.5};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(found.errors[i].of, names[i]);
    EXPECT_EQ(found.errors[i].samples, samples[i]) << names[i];
    EXPECT_EQ(found.errors[i].stated, stated[i]) << names[i];
    EXPECT_NEAR(found.errors[i].largest_m, largest_m[i], rounding_m) << names[i];
  }
  EXPECT_NEAR(found.errors[4].normalised_rms, 2, 1e-4);
  EXPECT_TRUE(std::isnan(found.errors[3].normalised_rms));
  EXPECT_TRUE(std::isnan(found.normalised[2]));
  EXPECT_TRUE(std::isnan(found.normalised[4]));
}

// The truth ends at x = 40 m in W; the samples are at 3, 8, ... 48 m.
TEST(DemTruth, ComparesOnlyWhereBothHaveHeights) {
  Rebuilt rebuilt;
  rebuilt.layers.frame.step_m.x = 5;
  rebuilt.layers.frame.cells_per_m.x = 0.2;
  for (std::size_t i = 0; i < 10; ++i) rebuilt.set(i, 0.01, HeightSource::Lidar, 0.01);
  const TruthComparison found = compare_with_truth(rebuilt.layers, rebuilt.georeference, plane());
  EXPECT_EQ(found.errors[0].samples, 8U);
  EXPECT_FALSE(std::isnan(found.error_m[7]));  // x = 38 m
  EXPECT_TRUE(std::isnan(found.error_m[8]));   // x = 43 m
}

TEST(DemTruth, StatisticsOfNoSamplesAreNan) {
  const Rebuilt rebuilt;
  const auto found = compare_with_truth(rebuilt.layers, rebuilt.georeference, plane()).errors;
  for (const HeightErrors& e : found) {
    EXPECT_EQ(e.samples, 0U);
    EXPECT_EQ(e.stated, 0U);
    for (const double figure : {e.bias_m, e.rmse_m, e.nmad_m, e.p95_m, e.largest_m,
                                e.normalised_rms, e.normalised_robust, e.within_1sd, e.within_2sd})
      EXPECT_TRUE(std::isnan(figure)) << e.of;
  }
}

}  // namespace
}  // namespace groundray::dem_truth_test
