#include "apps/view/rendering/moving_detail.h"

#include <gtest/gtest.h>

namespace groundray::moving_detail_test {
namespace {

std::size_t points_after(MovingDetail& detail, double seconds, int pictures) {
  for (int i = 0; i < pictures; ++i) detail.drawn(seconds);
  detail.begin();
  return detail.points();
}

TEST(MovingDetail, FollowsTheRenderingTime) {
  MovingDetail detail;
  const std::size_t first = detail.points();
  EXPECT_EQ(points_after(detail, 0.05, 20), first);  // frames take as long as intended
  EXPECT_EQ(points_after(detail, 0.01, 20), 2 * first);
  EXPECT_EQ(points_after(detail, 0.2, 20), first);
  EXPECT_EQ(points_after(detail, 0.2, 3), first);  // too few frames for a decision
  EXPECT_EQ(points_after(detail, 0.2, 20), first / 2);
}

TEST(MovingDetail, StaysWithinBounds) {
  MovingDetail fast, slow;
  const std::size_t first = fast.points();
  for (int i = 0; i < 20; ++i) {
    points_after(fast, 1e-3, 20);
    points_after(slow, 10, 20);
  }
  EXPECT_EQ(fast.points(), 64 * first);
  EXPECT_EQ(slow.points(), first / 4);
}

}  // namespace
}  // namespace groundray::moving_detail_test
