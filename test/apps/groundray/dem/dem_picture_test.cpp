#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "apps/groundray/dem/dem_report.h"

namespace groundray::dem_picture_test {
namespace {

using ::testing::Each;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr int gap = 8;  // white pixels between panels
using Rgb = std::array<int, 3>;
constexpr Rgb dark{31, 36, 51};

// Three columns and two rows from the north-west; each sample is drawn as 200 x 200 px.
DemLayers level_ground() {
  DemLayers layers = unknown_layers(
      {.samples = {3, 2}, .origin_m = {0, 0}, .step_m = {1, -1}, .cells_per_m = {1, -1}});
  std::ranges::fill(layers.elevation_m, 7.0F);
  std::ranges::fill(layers.variance_m2, 0.0004F);
  std::ranges::fill(layers.source, HeightSource::Lidar);
  return layers;
}

// Colour at the centre of a sample's square, by its column and row in a panel.
Rgb colour_of(const Image8& image, int panel, int column, int row) {
  const auto pixel = image.at(panel * (600 + gap) + 200 * column + 100, 200 * row + 100);
  return {pixel[0], pixel[1], pixel[2]};
}

TEST(DemPicture, HasThreePanelsOfAllSamples) {
  PictureScale scale;
  const Image8 image = draw_dem(level_ground(), {}, scale);
  EXPECT_EQ(image.width(), 3 * 600 + 2 * gap);
  EXPECT_EQ(image.height(), 400);
  for (const int x : {600, 607, 1208, 1215}) EXPECT_THAT(image.at(x, 200), Each(255));
  // Sine of the sun's elevation above level ground: 1.4 / sqrt(1 + 1 + 1.96).
  const int grey = static_cast<int>(std::lround(255 * (0.2 + 0.75 * 1.4 / std::sqrt(3.96))));
  for (const int panel : {0, 1}) {
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(colour_of(image, panel, i % 3, i / 3), (Rgb{grey, grey, grey}));
  }
}

TEST(DemPicture, ShowsHolesDarkAndFillsOrange) {
  DemLayers layers = level_ground();
  layers.source[1] = HeightSource::Filled;
  layers.fill_sd_m[1] = 0.5F;
  layers.source[5] = HeightSource::None;
  layers.elevation_m[5] = layers.variance_m2[5] = nan;
  PictureScale scale;
  const Image8 image = draw_dem(layers, {}, scale);
  EXPECT_EQ(colour_of(image, 0, 1, 0), dark);
  const Rgb orange = colour_of(image, 1, 1, 0);
  EXPECT_GT(orange[0], 1.5 * orange[1]);
  EXPECT_GT(orange[1], 2 * orange[2]);
  for (const int panel : {0, 1, 2}) EXPECT_EQ(colour_of(image, panel, 2, 1), dark);
  // At least 95 % of five standard deviations are all five: the largest is violet, the smallest
  // nearly yellow.
  EXPECT_FLOAT_EQ(static_cast<float>(scale.most_m), 0.5F);
  EXPECT_EQ(colour_of(image, 2, 1, 0), (Rgb{68, 1, 84}));
  EXPECT_GT(colour_of(image, 2, 0, 0)[0], 200);
}

TEST(DemPicture, ShowsErrorsRedWhereHeightsAreTooGreat) {
  PictureScale scale;
  const Image8 image = draw_dem(level_ground(), {0.0F, 0.02F, -0.04F, nan, 0.04F, -0.02F}, scale);
  EXPECT_FLOAT_EQ(static_cast<float>(scale.most_m), 0.04F);
  EXPECT_EQ(colour_of(image, 2, 0, 0), (Rgb{247, 247, 247}));
  EXPECT_EQ(colour_of(image, 2, 1, 1), (Rgb{191, 26, 26}));  // the most saturated red
  EXPECT_EQ(colour_of(image, 2, 2, 0), (Rgb{26, 64, 191}));  // the most saturated blue
  EXPECT_EQ(colour_of(image, 2, 0, 1), dark);
  const Rgb pale = colour_of(image, 2, 1, 0);
  EXPECT_EQ(pale, (Rgb{219, 136, 136}));  // halfway between white and the most saturated red
}

// The scale covers 95 % of the errors: of 20, one may be beyond it.
TEST(DemPicture, IsNotScaledByAFewLargeErrors) {
  DemLayers layers = unknown_layers(
      {.samples = {5, 4}, .origin_m = {0, 0}, .step_m = {1, -1}, .cells_per_m = {1, -1}});
  std::vector<float> errors_m(20, 0.01F);
  errors_m[3] = -9;
  PictureScale scale;
  draw_dem(layers, errors_m, scale);
  EXPECT_FLOAT_EQ(static_cast<float>(scale.most_m), 0.01F);
  std::ranges::fill(errors_m, 0.0F);
  draw_dem(layers, errors_m, scale);  // all errors are 0: the scale must not become 0
  EXPECT_EQ(scale.most_m, 1);
}

// Whatever the directions of rows and columns, north is up, east is right, and the light comes from
// the north-west: ground that faces it is bright.
TEST(DemPicture, HasNorthUpAndLightFromTheNorthWest) {
  for (const double x_step_m : {1., -1.}) {
    for (const double y_step_m : {1., -1.}) {
      DemLayers layers = unknown_layers({.samples = {3, 2},
                                         .origin_m = {0, 0},
                                         .step_m = {x_step_m, y_step_m},
                                         .cells_per_m = {x_step_m, y_step_m}});
      std::ranges::fill(layers.source, HeightSource::Lidar);
      for (int i = 0; i < 6; ++i) {
        const glm::dvec2 at = layers.frame.to_D({i % 3, i / 3});
        layers.elevation_m[static_cast<std::size_t>(i)] = static_cast<float>(0.5 * (at.x - at.y));
      }
      const std::size_t north_west = (y_step_m > 0 ? 3U : 0U) + (x_step_m > 0 ? 0U : 2U);
      layers.source[north_west] = HeightSource::Filled;
      PictureScale scale;
      const Image8 image = draw_dem(layers, {}, scale);
      EXPECT_EQ(colour_of(image, 0, 0, 0), dark);
      const int bright = colour_of(image, 0, 2, 1)[0];
      for (float& height_m : layers.elevation_m) height_m = -height_m;
      EXPECT_GT(bright, colour_of(draw_dem(layers, {}, scale), 0, 2, 1)[0] + 100);
    }
  }
}

}  // namespace
}  // namespace groundray::dem_picture_test
