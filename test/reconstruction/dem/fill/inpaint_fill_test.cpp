#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "core/error.h"
#include "reconstruction/dem/fill/dem_fill.h"

namespace groundray::inpaint_fill_test {
namespace {

// Both methods average nearby heights, so flat ground continues, and measured ground is unchanged.
TEST(InpaintFill, ContinuesFlatGroundAndKeepsMeasuredHeights) {
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 100);
  for (const Inpainting by : {Inpainting::Telea, Inpainting::NavierStokes}) {
    std::vector<float> flat_m(1200, 7.25f), rough_m(1200);
    for (float& z : rough_m) z = uniform(random);
    for (std::size_t i = 410; i < 420; ++i) flat_m[i] = flat_m[i + 40] = rough_m[i] = none;
    for (const float z : fill_by_inpainting({40, 30}, flat_m, by)) EXPECT_NEAR(z, 7.25, 1e-4);
    const auto filled_m = fill_by_inpainting({40, 30}, rough_m, by);
    for (std::size_t i = 0; i < rough_m.size(); ++i) {
      EXPECT_FALSE(std::isnan(filled_m[i]));
      if (!std::isnan(rough_m[i])) {
        EXPECT_EQ(filled_m[i], rough_m[i]);
      }
    }
    EXPECT_THROW((void)fill_by_inpainting({5, 4}, flat_m, by), Error);
  }
}

}  // namespace
}  // namespace groundray::inpaint_fill_test
