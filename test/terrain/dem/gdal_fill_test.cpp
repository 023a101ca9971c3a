#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_io.h"

namespace groundray::gdal_fill_test {
namespace {

using ::testing::Each;

constexpr float none = std::numeric_limits<float>::quiet_NaN();

TEST(GdalFill, FillsHolesUpToTheGivenDistance) {
  std::vector<float> heights_m(2000, 3);
  for (int row = 5; row < 35; ++row)
    for (int column = 5; column < 35; ++column)
      heights_m[static_cast<std::size_t>(row) * 50 + static_cast<std::size_t>(column)] = none;
  EXPECT_THAT(fill_by_gdal({50, 40}, heights_m, 100), Each(3));
  const auto near_m = fill_by_gdal({50, 40}, heights_m, 4);
  EXPECT_EQ(near_m[320], 3);
  EXPECT_TRUE(std::isnan(near_m[1020]));
  EXPECT_THROW((void)fill_by_gdal({5, 4}, heights_m, 4), Error);
}

}  // namespace
}  // namespace groundray::gdal_fill_test
