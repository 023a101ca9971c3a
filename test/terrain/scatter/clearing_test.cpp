#include "terrain/scatter/clearing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace groundray::clearing_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

glm::dvec2 somewhere(std::uint32_t i) {
  return random_uniform({.seed = {5}, .pulse = i}) * 40.0 - 20.0;
}

TEST(Clearing, OnePointClearsADisc) {
  const std::vector<Clearing> disc = {{.points_D = {{3, -2}}, .half_width_m = 5}};
  const ClearedGround cleared(disc);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const glm::dvec2 p = somewhere(i);
    EXPECT_EQ(cleared.contains(p), std::hypot(p.x - 3, p.y + 2) <= 5);
  }
}

// Two sections at a right angle; the oracle distinguishes points beside a section and points past
// an end.
TEST(Clearing, LineClearsItsWidthWithRoundedEnds) {
  const std::vector<Clearing> track = {
      {.points_D = {{-10, 0}, {10, 0}, {10, 0}, {10, 12}}, .half_width_m = 2}};
  const ClearedGround cleared(track);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const glm::dvec2 p = somewhere(i);
    const bool beside = (std::abs(p.x) <= 10 && std::abs(p.y) <= 2) ||
                        (0 <= p.y && p.y <= 12 && std::abs(p.x - 10) <= 2);
    const bool past = std::hypot(p.x + 10, p.y) <= 2 || std::hypot(p.x - 10, p.y - 12) <= 2 ||
                      std::hypot(p.x - 10, p.y) <= 2;
    EXPECT_EQ(cleared.contains(p), beside || past) << p.x << " " << p.y;
  }
}

TEST(Clearing, PolygonClearsItsInteriorAndMargin) {
  std::vector<Clearing> lot = {{.points_D = {{-8, -8}, {8, -8}, {8, 8}, {0, 8}, {0, 0}, {-8, 0}},
                                .half_width_m = 0,
                                .shape = Clearing::Shape::Polygon}};
  const auto is_inside = [](glm::dvec2 p) {
    return std::abs(p.x) <= 8 && std::abs(p.y) <= 8 && !(p.x < 0 && p.y > 0);
  };
  const ClearedGround bare(lot);
  lot[0].half_width_m = 1;
  const ClearedGround wide(lot);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const glm::dvec2 p = somewhere(i);
    EXPECT_EQ(bare.contains(p), is_inside(p));
    // A point is within 1 m of the L if it is within 1 m of one of the two boxes that form it.
    const auto from_box = [&](double west, double south, double east, double north) {
      return std::hypot(std::max({west - p.x, p.x - east, 0.0}),
                        std::max({south - p.y, p.y - north, 0.0}));
    };
    EXPECT_EQ(wide.contains(p), std::min(from_box(-8, -8, 8, 0), from_box(0, -8, 8, 8)) <= 1);
  }
}

TEST(Clearing, SubsetNearAnAreaMatchesAllClearingsThere) {
  std::vector<Clearing> all;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const glm::dvec2 a = somewhere(1000 + 3 * i), b = a + somewhere(1001 + 3 * i) / 5.0;
    all.push_back({.points_D = {a, b, a + glm::dvec2(0, 2)},
                   .half_width_m = i % 4 * 0.4,
                   .shape = i % 3 == 0 ? Clearing::Shape::Polygon : Clearing::Shape::Line});
  }
  const ClearedGround cleared(all);
  int free = 0;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const glm::dvec2 low = somewhere(2 * i);
    const Area area{low, low + glm::abs(somewhere(2 * i + 1)) / 3.0};
    const ClearedGround part = cleared.near(area);
    for (std::uint32_t j = 0; j < 20; ++j) {
      const glm::dvec2 p =
          low + random_uniform({.seed = {6}, .frame = i, .pulse = j}) * (area.high_m - area.low_m);
      EXPECT_EQ(part.contains(p), cleared.contains(p));
      free += cleared.contains(p) ? 0 : 1;
    }
  }
  EXPECT_GT(free, 400);  // both answers occur
  EXPECT_LT(free, 3600);
}

TEST(Clearing, ErrorListsEveryFault) {
  const std::vector<Clearing> bad = {
      {.points_D = {}},
      {.points_D = {{0, 0}, {1, 1}}, .shape = Clearing::Shape::Polygon},
      {.points_D = {{0, std::numeric_limits<double>::quiet_NaN()}}, .half_width_m = -1}};
  EXPECT_THAT([&] { ClearedGround{bad}; },
              ThrowsMessage<Error>(AllOf(HasSubstr("clearing 0 has 0 points; it needs 1"),
                                         HasSubstr("clearing 1 has 2 points; it needs 3"),
                                         HasSubstr("clearing 2 has a point that is not finite"),
                                         HasSubstr("clearing 2 has half_width_m = -1"))));
}

}  // namespace
}  // namespace groundray::clearing_test
