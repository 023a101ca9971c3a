#include "sensors/camera/lens/pixel_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "test/support/lens_samples.h"
#include "test/support/margin.h"

namespace groundray::pixel_patch_test {
namespace {

using groundray::testing::LensSample;
using groundray::testing::sample_lenses;

class PixelPatchOfLens : public ::testing::TestWithParam<LensSample> {};

// The image of a position's direction is the position itself: Lens::project is independent of
// patches. All positions that the lens images must be found, except at the boundary, where the
// lens's own search stops marginally short.
TEST_P(PixelPatchOfLens, DirectionsProjectBackToTheirPositions) {
  const Lens lens(GetParam().model, GetParam().size_px);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  double worst_px = 0;
  for (int y = 0; y < lens.size_px().y; y += 3) {
    RayRows rows(lens);
    rows.fill(y, std::min(y + 3, lens.size_px().y));
    for (int x = y % 5; x < lens.size_px().x; x += 5) {
      const glm::ivec2 pixel(x, y + x % 3);
      if (pixel.y >= lens.size_px().y || !rows.looks(pixel)) continue;
      const PixelPatch patch = rows.patch(pixel);
      for (int i = 0; i < 3; ++i) {
        const glm::dvec2 offset_px(std::copysign(0.5, unit(random)), unit(random));
        const auto direction = patch.direction(offset_px);
        if (!direction) {
          EXPECT_FALSE(lens.ray(glm::dvec2(pixel) + offset_px));
          continue;
        }
        EXPECT_NEAR(glm::length(*direction), 1, 1e-12);
        const auto place = lens.project(*direction);
        ASSERT_TRUE(place);
        worst_px = std::max(worst_px, glm::distance(*place, glm::dvec2(pixel) + offset_px));
      }
    }
  }
  EXPECT_LT(worst_px, PixelPatch::error_px);
  testing::record_margin("place", worst_px, PixelPatch::error_px, "px");
}

INSTANTIATE_TEST_SUITE_P(Sample, PixelPatchOfLens, ::testing::ValuesIn(sample_lenses()),
                         [](const auto& of) {
                           std::string name = of.param.name;
                           std::erase_if(name, [](char c) { return !std::isalnum(c); });
                           return name;
                         });

}  // namespace
}  // namespace groundray::pixel_patch_test
