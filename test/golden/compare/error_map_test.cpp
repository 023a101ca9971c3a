#include "apps/golden/compare/error_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace groundray::golden::error_map_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(ErrorScale, EndsAreRoundedUp) {
  EXPECT_EQ(error_scale_of({0.03, 0.03, 0.03}).end, 0.04);
  EXPECT_EQ(error_scale_of({-0.9}).end, 1);
  EXPECT_EQ(error_scale_of({8, 8}).end, 8);
  EXPECT_EQ(error_scale_of({}).end, 1);
  EXPECT_EQ(error_scale_of({0, 0}).end, 1);
  EXPECT_FALSE(error_scale_of({0, 2}).is_signed);
  EXPECT_TRUE(error_scale_of({0, -2, std::nan("")}).is_signed);
}

// The bar's marks are at equal steps of the square root: a quarter of the end is halfway.
TEST(ErrorScale, BarsHaveNumbers) {
  const ColourBar bar = ErrorScale{.end = 0.4}.bar("error, m");
  std::vector<std::string> texts;
  for (const auto& mark : bar.marks) texts.push_back(mark.second);
  EXPECT_THAT(texts, ElementsAre("−0.4", "−0.1", "0", "0.1", "0.4"));
  EXPECT_EQ(bar.marks[2].first, 0.5);
  const ColourBar sizes = ErrorScale{.end = 0.4, .is_signed = false}.bar("error, m");
  ASSERT_EQ(sizes.marks.size(), 3u);
  EXPECT_EQ(sizes.marks[0].second, "0");
  EXPECT_EQ(sizes.marks[1].second, "0.1");
}

// 10 m x 5 m in cells of 1 m: north is up, and the largest error of a cell counts.
TEST(ErrorMap, ShowsTheLargestErrorOfEachCell) {
  ErrorMap map({0, 0}, {10, 5}, glm::ivec2(10, 5));
  map.add({0.5, 4.5}, 0.01);
  map.add({0.2, 4.9}, -2);
  map.add({9.5, 0.5}, 2);
  map.add({10, 5}, 2);  // the upper edges belong to the last cells
  map.add({10.5, 0.5}, 99);
  map.add_unpaired({5.5, 2.5});
  map.add_unpaired({0.5, 4.5});
  const Picture picture = map.picture("errors", "x, m", "y, m", "error, m");
  ASSERT_EQ(picture.image.width() % 10, 0);
  ASSERT_EQ(picture.image.height() % 5, 0);
  const int x_px = picture.image.width() / 10, y_px = picture.image.height() / 5;
  const auto at = [&](int column, int row) {
    const auto pixel = picture.image.at(column * x_px, row * y_px);
    return std::array<int, 3>{pixel[0], pixel[1], pixel[2]};
  };
  EXPECT_GT(at(0, 0)[2], at(0, 0)[0] + 60);  // blue
  EXPECT_GT(at(9, 4)[0], at(9, 4)[2] + 60);  // red
  EXPECT_GT(at(9, 0)[0], at(9, 0)[2] + 60);
  EXPECT_THAT(at(5, 2), ElementsAre(0, 0, 0));
  EXPECT_EQ(at(3, 3)[0], at(3, 3)[2]);  // grey
  EXPECT_EQ(picture.across->high, 10);
  EXPECT_EQ(picture.up->high, 5);
  EXPECT_THAT(picture.caption, HasSubstr("darker: missing or extra returns, black if all are"));
  ErrorMap other({0, 0}, {1, 1}, 10);
  other.add({0.5, 0.5}, 1);
  EXPECT_THAT(other.picture("", "", "", "").caption, Not(HasSubstr("black")));
}

TEST(ErrorMap, DarkensCellsByTheShareOfPointsWithoutAPartner) {
  ErrorMap map({0, 0}, {2, 1}, glm::ivec2(2, 1));
  for (const double x : {0.5, 1.5}) map.add({x, 0.5}, 1);
  map.add_unpaired({1.5, 0.5});
  const Picture picture = map.picture("", "", "", "");
  const auto alone = picture.image.at(0, 0), half = picture.image.at(picture.image.width() - 1, 0);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(half[k], alone[k] / 2.0, 1) << k;
}

TEST(ErrorMap, AcceptsASinglePoint) {
  ErrorMap map({3, 4}, {3, 4}, 100);
  map.add({3, 4}, 1);
  const Picture picture = map.picture("one", "x", "y", "error");
  EXPECT_GT(picture.across->high, 3);
  EXPECT_GT(picture.up->high, 4);
}

}  // namespace
}  // namespace groundray::golden::error_map_test
