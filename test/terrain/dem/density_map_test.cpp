#include "terrain/dem/density_map.h"

#include <gdal.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_file.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"

namespace groundray::density_map_test {
namespace {

using ::testing::AllOf;
using testing::GeoTiff;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(DensityMap, DensityIsConstantWithinAPixel) {
  const DensityMap map({3, 2}, {10, 20}, {2, -4}, {1, 2, 3, 4, nan, 6});
  EXPECT_EQ(map.per_m2_at({10, 20}), 1);  // a pixel includes the edges at which it begins
  EXPECT_EQ(map.per_m2_at({11.999, 16.001}), 1);
  EXPECT_EQ(map.per_m2_at({12, 16.001}), 2);
  EXPECT_EQ(map.per_m2_at({15, 18}), 3);
  EXPECT_EQ(map.per_m2_at({10, 16}), 4);
  EXPECT_EQ(map.per_m2_at({13, 14}), 0);  // NaN means no plants
  EXPECT_EQ(map.per_m2_at({15.999, 12.001}), 6);
  for (const glm::dvec2 outside :
       {glm::dvec2(9.999, 15), {16, 15}, {12, 20.001}, {12, 12}, {-infinity, 15}}) {
    EXPECT_EQ(map.per_m2_at(outside), 0);
  }
  EXPECT_EQ(map.max_per_m2(), 6);
  EXPECT_EQ(map.grown_m2(), 5 * 8);
  EXPECT_EQ(map.area().low_m, glm::dvec2(10, 12));
  EXPECT_EQ(map.area().high_m, glm::dvec2(16, 20));
}

TEST(DensityMap, ConstantDensityIsUnbounded) {
  const DensityMap map(0.25);
  EXPECT_EQ(map.per_m2_at({1e9, -1e9}), 0.25);
  EXPECT_EQ(map.max_per_m2(), 0.25);
}

// Pixels of 1 m from -4 m to 4 m, one in five with plants; closed boxes on a lattice of 1/4 m.
TEST(DensityMap, AreaIsEmptyIfNoIntersectingPixelHasPlants) {
  std::vector<float> per_m2;
  for (int i = 0; i < 64; ++i) per_m2.push_back(i * 7 % 5 == 0 ? 1 : 0);
  const DensityMap map({8, 8}, {-4, 4}, {1, -1}, per_m2);
  int empty = 0;
  for (int i = 0; i < 4096; ++i) {
    const glm::dvec2 low = glm::dvec2(glm::ivec2(i % 64, i / 64)) / 4. - 8.;
    const glm::dvec2 high = low + glm::dvec2(i % 7, i % 5) / 2.;
    bool has_plants = false;
    for (double x = low.x; x <= high.x; x += 0.125) {
      for (double y = low.y; y <= high.y; y += 0.125) has_plants |= map.per_m2_at({x, y}) > 0;
    }
    EXPECT_EQ(map.is_empty({low, high}), !has_plants);
    empty += has_plants ? 0 : 1;
  }
  EXPECT_GT(empty, 400);
  EXPECT_LT(empty, 3600);
}

TEST(DensityMap, ReportsInvalidDensities) {
  EXPECT_THAT([] { DensityMap(-1); }, ThrowsMessage<Error>(HasSubstr("-1 plants per m2")));
  EXPECT_THAT([] { DensityMap{infinity}; }, ThrowsMessage<Error>(HasSubstr("finite")));
  EXPECT_THAT(
      [] {
        DensityMap({2, 2}, {0, 0}, {1, 0}, {1, 2, 3});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("3 densities do not fill 2 x 2"),
                                 HasSubstr("step (1, 0) m must be finite"))));
  EXPECT_THAT(
      [] {
        DensityMap({2, 2}, {0, 0}, {1, 1}, {1, 2, 3, -0.5});
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("column 1, row 1 is -0.5"), HasSubstr("is that value nodata?"))));
}

// Values 0 to 5 in pixels of 2 m x 2 m, to the south and east of (500000, 5150000).
GeoTiff six_pixels() { return {.size = {3, 2}, .values = {0, 1, 2, 3, 4, 5}}; }

TEST(DensityMap, FileFollowsItsGeotransform) {
  const TemporaryFolder folder;
  six_pixels().save(folder / "d.tif");
  const DensityMap map = load_density_map(folder / "d.tif", {.origin_w_m = {500001, 5149990, 0}});
  EXPECT_EQ(map.area().low_m, glm::dvec2(-1, 6));
  EXPECT_EQ(map.area().high_m, glm::dvec2(5, 10));
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(map.per_m2_at(glm::dvec2(i % 3, -(i / 3)) * 2.0 + glm::dvec2(0, 9)), i);
  }
}

TEST(DensityMap, AppliesScaleOffsetFactorAndNodata) {
  const TemporaryFolder folder;
  GeoTiff raster = six_pixels();
  raster.scale = 0.5;
  raster.offset = 0.25;
  raster.nodata = 5;
  raster.save(folder / "d.tif");
  GDALDatasetH file = GDALOpen((folder / "d.tif").c_str(), GA_Update);
  GDALSetRasterUnitType(GDALGetRasterBand(file, 1), "1/m2");  // not a unit of length
  GDALClose(file);
  const DensityMap map = load_density_map(
      folder / "d.tif", {.factor_per_m2 = 2, .nodata = 4, .origin_w_m = {500000, 5150000, 0}});
  EXPECT_EQ(map.per_m2_at({3, -1}), 2 * (1 * 0.5 + 0.25));
  EXPECT_EQ(map.per_m2_at({3, -3}), 0);
  EXPECT_EQ(map.per_m2_at({5, -3}), 0);
  EXPECT_EQ(map.max_per_m2(), 2 * (3 * 0.5 + 0.25));
}

// A vertical unit of feet applies to heights, not to densities.
TEST(DensityMap, IgnoresTheVerticalUnitOfTheCrs) {
  const TemporaryFolder folder;
  GeoTiff raster = six_pixels();
  raster.crs = "EPSG:26915+6360";  // NAVD88 height in US survey feet
  raster.save(folder / "d.tif");
  EXPECT_EQ(load_density_map(folder / "d.tif", {}).max_per_m2(), 5);
}

std::string wkt(const char* name) {
  const TemporaryFolder folder;
  GeoTiff raster = six_pixels();
  raster.crs = name;
  raster.save(folder / "crs.tif");
  return DemFile(folder / "crs.tif").header().crs_wkt;
}

// Expected positions from GDAL: 9 E, 46.5 N, the edge between the two halves, is at (500000,
// 5149603.4) in zone 32 and at (960347.1, 5167118.9) in zone 31, where north is rotated by 4.4
// degrees.
TEST(DensityMap, FileInAnotherCrsIsWarpedToTheGroundsCrs) {
  const TemporaryFolder folder;
  GeoTiff raster{.size = {200, 200}, .values = {}};
  raster.geotransform = {499000, 10, 0, 5151000, 0, -10};
  raster.crs = "EPSG:32632";
  for (int i = 0; i < 40'000; ++i) raster.values.push_back(i % 200 < 100 ? 2 : 0.5);
  raster.save(folder / "d.tif");
  const std::string zone_31 = wkt("EPSG:32631");
  const DensityMap map = load_density_map(folder / "d.tif", {.crs_wkt = zone_31});
  EXPECT_EQ(map.max_per_m2(), 2);
  EXPECT_EQ(map.per_m2_at({960347.1 - 15, 5167118.9}), 2);
  EXPECT_EQ(map.per_m2_at({960347.1 + 15, 5167118.9}), 0.5);
  EXPECT_EQ(load_density_map(folder / "d.tif", {.crs_wkt = wkt("EPSG:32632")}).area().low_m,
            glm::dvec2(499000, 5149000));  // the same CRS: unchanged
}

TEST(DensityMap, ReportsInvalidFiles) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { load_density_map(folder / "none.tif", {}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("none.tif"), HasSubstr("no such file"))));
  GeoTiff raster = six_pixels();
  raster.values[4] = -1;
  raster.save(folder / "negative.tif");
  EXPECT_THAT([&] { load_density_map(folder / "negative.tif", {}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("negative.tif"), HasSubstr("row 1 is -1"))));
  raster = six_pixels();
  raster.crs = "EPSG:4326";
  raster.geotransform = {9, 0.01, 0, 46, 0, -0.01};
  raster.save(folder / "degrees.tif");
  EXPECT_THAT([&] { load_density_map(folder / "degrees.tif", {}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("degrees.tif"), HasSubstr("gdalwarp"))));
  six_pixels().save(folder / "good.tif");
  EXPECT_THAT([&] { load_density_map(folder / "good.tif", {.factor_per_m2 = -2}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("good.tif"), HasSubstr("factor_per_m2 = -2"))));
}

}  // namespace
}  // namespace groundray::density_map_test
