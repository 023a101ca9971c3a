#include "terrain/dem_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "terrain/dem_io.h"
#include "terrain/gdal_fill.h"
#include "test/support/geotiff.h"
#include "test/support/temporary_folder.h"

namespace groundray {
namespace {

using ::testing::Each;
using testing::GeoTiff;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr float none = std::numeric_limits<float>::quiet_NaN();

void expect_same(std::span<const float> found_m, std::span<const float> written_m) {
  ASSERT_EQ(found_m.size(), written_m.size());
  for (std::size_t i = 0; i < found_m.size(); ++i) {
    EXPECT_EQ(std::isnan(found_m[i]), std::isnan(written_m[i])) << i;
    if (!std::isnan(written_m[i])) {
      EXPECT_EQ(found_m[i], written_m[i]) << i;
    }
  }
}

TEST(DemWriter, WhatItWritesIsReadAgain) {
  const TemporaryFolder folder;
  std::vector<double> heights_m(1200);
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    heights_m[i] = i % 7 == 0 ? -9999 : std::sin(static_cast<double>(i)) * 100;
  for (const char* kind : {"Area", "Point"}) {
    for (const double nodata : {-9999.0, -32768.0}) {
      GeoTiff{.size = {40, 30}, .values = heights_m, .crs = "EPSG:26915", .nodata = nodata}.save(
          folder / "in.tif");
      {
        const std::unique_ptr<void, decltype(&GDALClose)> file(
            GDALOpen((folder / "in.tif").c_str(), GA_Update), &GDALClose);
        GDALSetMetadataItem(file.get(), "AREA_OR_POINT", kind, nullptr);
      }
      const Dem dem = load_dem(folder / "in.tif");
      DemPlace place = describe_file(folder / "in.tif");
      EXPECT_EQ(place.nodata, nodata);
      EXPECT_EQ(place.is_point, std::string(kind) == "Point");
      place.frame = dem.grid.frame();
      place.origin_w_m = dem.origin_w_m;
      place.crs_wkt = dem.crs_wkt;
      write_dem(folder / "out.tif", place, dem.grid.heights_m());
      const Dem again = load_dem(folder / "out.tif");
      EXPECT_EQ(again.crs_name, dem.crs_name);
      EXPECT_EQ(again.origin_w_m, dem.origin_w_m);
      EXPECT_EQ(again.grid.origin_m(), dem.grid.origin_m());
      EXPECT_EQ(again.grid.step_m(), dem.grid.step_m());
      expect_same(again.grid.heights_m(), dem.grid.heights_m());
      const DemPlace told = describe_file(folder / "out.tif");
      EXPECT_EQ(told.is_point, place.is_point);
      // The second file has heights of -9999 beside holes of -32768: both stay what they are.
      EXPECT_EQ(told.nodata, nodata);
    }
  }
}

TEST(DemWriter, NoHeightIsTakenForAHole) {
  const TemporaryFolder folder;
  DemPlace place{.frame = {{4, 2}, {0, 0}, {1, -1}, {1, -1}}, .nodata = 0};
  const std::vector<float> heights_m{0, 1, 2, none, 4, 5, 6, 7};
  write_dem(folder / "zero.tif", place, heights_m);
  expect_same(load_dem(folder / "zero.tif").grid.heights_m(), heights_m);
  place.nodata = 0.1;  // no float
  write_dem(folder / "tenth.tif", place, heights_m);
  expect_same(load_dem(folder / "tenth.tif").grid.heights_m(), heights_m);
}

TEST(DemWriter, RefusesWhatItCannotTell) {
  const TemporaryFolder folder;
  const std::vector<float> heights_m(8, 1);
  const auto message = [&](const GridFrame& frame, const char* name) -> std::string {
    try {
      write_dem(folder / name, {.frame = frame}, heights_m);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message({{4, 3}, {0, 0}, {1, 1}, {1, 1}}, "a.tif"),
              ::testing::AllOf(HasSubstr("8 values for 4 x 3"), HasSubstr("north to south")));
  EXPECT_THAT(message({{4, 2}, {0, 0}, {1, -1}, {1, -1}}, "missing/a.tif"), HasSubstr("missing"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(GdalFill, FillsWhatIsNearAndLeavesWhatIsFar) {
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
}  // namespace groundray
