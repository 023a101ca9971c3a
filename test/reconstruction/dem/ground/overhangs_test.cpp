#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/error.h"
#include "reconstruction/dem/ground/ground_filter.h"

namespace groundray::overhangs_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

GridFrame frame_of(int columns, int rows, double step_m) {
  return {.samples = {columns, rows},
          .origin_m = {0, 0},
          .step_m = {step_m, -step_m},
          .cells_per_m = {1 / step_m, -1 / step_m}};
}

// Points of one sample's cell, set by hand: level ground at `ground_m` and heights above it.
struct Column {
  std::vector<glm::dvec3> points_m;
  GroundPoints ground;

  void add(double x_m, double height_m, GroundClass what, double ground_m = 10) {
    points_m.emplace_back(x_m, 0, ground_m + height_m);
    ground.height_m.push_back(static_cast<float>(height_m));
    ground.classes.push_back(what);
  }
};

TEST(Overhangs, AreSeparatedFromTheGroundByAGap) {
  Column column;
  column.add(0.1, 4, GroundClass::Above);  // the branch comes first: order does not matter
  column.add(0, 0.05, GroundClass::Ground);
  column.add(0, -0.02, GroundClass::Ground);
  column.add(0, 2.55, GroundClass::Above);
  column.add(0, 2.8, GroundClass::Above);
  column.add(0, -7, GroundClass::Below);
  column.add(1, 0, GroundClass::Ground);  // a bush in the next cell
  for (int i = 1; i < 8; ++i) column.add(1, 0.25 * i, GroundClass::Above);
  column.add(2, 3, GroundClass::Above);  // no ground seen
  column.add(2, 3.1, GroundClass::Above);
  column.add(9, 3, GroundClass::Above);  // outside
  const Overhangs found = find_overhangs(column.points_m, column.ground, frame_of(4, 1, 1), 0.3);
  EXPECT_THAT(found.surfaces, ::testing::ElementsAre(3, 1, 1, 0));
  EXPECT_FLOAT_EQ(found.overhang_m[0], 12.55f);
  EXPECT_FLOAT_EQ(found.clearance_m[0], 2.5f);
  EXPECT_TRUE(std::isnan(found.overhang_m[1]));
  EXPECT_FLOAT_EQ(found.overhang_m[2], 13.f);
  EXPECT_FLOAT_EQ(found.clearance_m[2], 3.f);
  EXPECT_TRUE(std::isnan(found.overhang_m[3]));
}

// A level deck over a valley: the clearance is known up to the points' noise and the ground's rise
// within a cell.
TEST(Overhangs, HaveTheClearanceOfABridge) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 60);
  const auto valley_m = [](double x) { return -5 * std::exp(-(x - 30) * (x - 30) / 100); };
  std::vector<glm::dvec3> points_m;
  for (int i = 0; i < 60000; ++i) {
    const double x = uniform(random), y = uniform(random);
    points_m.emplace_back(x, y, valley_m(x));
    if (std::abs(x - 30) < 8 && std::abs(y - 30) < 3) points_m.emplace_back(x, y, 0.5);
  }
  const GridFrame frame{.samples = {60, 60}, .origin_m = {0.5, 0.5}};
  const Overhangs found = find_overhangs(points_m, filter_ground(points_m), frame, 0.3);
  for (std::size_t i = 0, row = 0; row < 60; ++row) {
    for (std::size_t column = 0; column < 60; ++column, ++i) {
      const double x = static_cast<double>(column) + 0.5, y = static_cast<double>(row) + 0.5;
      if (std::abs(x - 30) < 8 && std::abs(y - 30) < 3) {
        EXPECT_EQ(found.surfaces[i], 2) << column << " " << row;
        EXPECT_FLOAT_EQ(found.overhang_m[i], 0.5f);
        EXPECT_NEAR(found.clearance_m[i], 0.5 - valley_m(x), 0.4);
      } else {
        EXPECT_EQ(found.surfaces[i], 1) << column << " " << row;
        EXPECT_TRUE(std::isnan(found.overhang_m[i]));
      }
    }
  }
}

TEST(Overhangs, RejectsInconsistentInput) {
  const std::vector<glm::dvec3> one{{0, 0, 0}};
  const GroundPoints ground = filter_ground(one);
  const auto fault_of = [&](const std::vector<glm::dvec3>& points_m, const GridFrame& frame,
                            double gap_m) -> std::string {
    try {
      find_overhangs(points_m, ground, frame, gap_m);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(fault_of(one, frame_of(1, 1, 1), 0.3), "none");
  EXPECT_THAT(fault_of({}, frame_of(0, 1, 1), 0),
              AllOf(HasSubstr("0 points but 1 classes"), HasSubstr("0 x 1"), HasSubstr("gap_m")));
  EXPECT_THAT(fault_of(one, frame_of(1, 1, 0), 0.3), HasSubstr("cells per metre"));
}

}  // namespace
}  // namespace groundray::overhangs_test
