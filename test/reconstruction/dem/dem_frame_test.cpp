#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray::dem_frame_test {
namespace {

using ::testing::HasSubstr;

void expect_refusal(const std::function<void()>& act, const char* message) {
  try {
    act();
    ADD_FAILURE() << "no Error that says: " << message;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(message));
  }
}

TEST(DemFrame, CellsFillAnAreaOfWholeCellsExactly) {
  const GridFrame frame = frame_over({{-3, 2}, {7, 5}}, 0.5);
  EXPECT_EQ(frame.samples, glm::ivec2(20, 6));
  EXPECT_EQ(frame.origin_m, glm::dvec2(-2.75, 4.75));  // north-west, at the centre of its cell
  EXPECT_EQ(frame.step_m, glm::dvec2(0.5, -0.5));
  EXPECT_EQ(frame.cells_per_m, glm::dvec2(2, -2));
}

TEST(DemFrame, CellsCoverTheAreaAndAlignToMultiplesOfTheirSize) {
  const Area area{{10.03, -7.7}, {12.9, -3.31}};
  for (const double cell_m : {0.1, 0.25, 0.7, 1.0, 3.0}) {
    const GridFrame frame = frame_over(area, cell_m);
    const glm::dvec2 first = frame.origin_m - 0.5 * frame.step_m;
    const glm::dvec2 last = first + glm::dvec2(frame.samples) * frame.step_m;
    constexpr double rounding_m = 1e-9;
    EXPECT_LE(first.x, area.low_m.x + rounding_m);
    EXPECT_GT(first.x, area.low_m.x - cell_m);
    EXPECT_GE(first.y, area.high_m.y - rounding_m);
    EXPECT_LT(first.y, area.high_m.y + cell_m);
    EXPECT_GE(last.x, area.high_m.x - rounding_m);
    EXPECT_LE(last.y, area.low_m.y + rounding_m);
    // Borders lie at whole multiples of the cell, so adjacent areas give adjacent frames.
    EXPECT_NEAR(std::remainder(first.x, cell_m), 0, 1e-12);
    EXPECT_NEAR(std::remainder(first.y, cell_m), 0, 1e-12);
  }
}

TEST(DemFrame, FinerFramesContainTheSamplesOfTheDem) {
  const GridFrame dem{{100, 80}, {3.125, 40.5}, {0.25, -0.5}, {4, -2}};
  for (const int finer : {1, 2, 5}) {
    const GridFrame frame = frame_like(dem, {{-2, 20}, {50, 33}}, finer);
    EXPECT_EQ(frame.step_m, dem.step_m / static_cast<double>(finer));
    for (const glm::ivec2 sample : {glm::ivec2(0, 20), glm::ivec2(99, 30), glm::ivec2(17, 40)}) {
      const glm::dvec2 at = frame.to_grid(dem.to_D(sample));
      EXPECT_NEAR(at.x, std::round(at.x), 1e-9);
      EXPECT_NEAR(at.y, std::round(at.y), 1e-9);
      EXPECT_GE(at.x, 0);
      EXPECT_LT(at.x, frame.samples.x);
    }
  }
}

TEST(DemFrame, RejectsInvalidAreasAndCellSizes) {
  const double infinity = std::numeric_limits<double>::infinity();
  expect_refusal([] { frame_over({{0, 0}, {0, 5}}, 1); }, "must be bounded and not empty");
  expect_refusal([&] { frame_over({{0, 0}, {infinity, 5}}, 1); }, "must be bounded");
  expect_refusal([] { frame_over({{0, 0}, {1, 5}}, 0); }, "cell_m = 0 must be above 0");
  expect_refusal([] { frame_over({{0, 0}, {1e9, 5}}, 1e-3); }, "choose larger cells");
  expect_refusal([] { frame_like({}, {{0, 0}, {1, 5}}, 0); }, "finer = 0 must be at least 1");
}

TEST(DemFrame, ReportsAllInvalidFields) {
  const GridFrame frame{{1, 5}, {0, 0}, {0, 1}, {1, 2}};
  expect_refusal([&] { refuse_faults(frame); }, "1 x 5 samples must be at least 2 x 2");
  expect_refusal([&] { refuse_faults(frame); }, "step_m = 0 along axis 0");
  expect_refusal([&] { refuse_faults(frame); }, "cells_per_m = 2 along axis 1 must be 1 / step_m");
}

}  // namespace
}  // namespace groundray::dem_frame_test
