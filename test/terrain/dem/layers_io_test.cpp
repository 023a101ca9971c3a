#include "terrain/dem/layers_io.h"

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_io.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"

namespace groundray::layers_io_test {
namespace {

using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr float hole = std::numeric_limits<float>::quiet_NaN();

void expect_same(std::span<const float> found_m, std::span<const float> written_m) {
  ASSERT_EQ(found_m.size(), written_m.size());
  for (std::size_t i = 0; i < found_m.size(); ++i) {
    EXPECT_EQ(std::isnan(found_m[i]), std::isnan(written_m[i])) << i;
    if (!std::isnan(written_m[i])) {
      EXPECT_EQ(found_m[i], written_m[i]) << i;
    }
  }
}

class LayersIo : public ::testing::Test {
 protected:
  std::string error_of(const GridFrame& frame, std::span<const RasterLayer> layers) const {
    try {
      write_layers(file_, frame, place_, layers);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  testing::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "layers.tif";
  Georeference place_{.origin_w_m = {500100, 5150000, 0}};
  GridFrame frame_{
      .samples = {3, 2}, .origin_m = {-2, 1.5}, .step_m = {2, -3}, .cells_per_m = {0.5, -1.0 / 3}};
  std::vector<float> heights_m_{1, 2, hole, 4.25F, 5, -6};
  std::vector<float> counts_{7, 0, 3, 1, 2, 16777216};
};

TEST_F(LayersIo, WrittenElevationsAreReadBack) {
  write_layers(file_, frame_, place_,
               std::vector<RasterLayer>{{"elevation", "m", heights_m_}, {"n_lidar", "", counts_}});
  const Dem dem = load_dem(file_);
  EXPECT_EQ(dem.crs_name, "local (no CRS)");
  EXPECT_EQ(dem.grid.columns(), 3);
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(2, -3));
  EXPECT_EQ(dem.grid.origin_m() + glm::dvec2(dem.origin_w_m),
            frame_.origin_m + glm::dvec2(place_.origin_w_m));
  expect_same(dem.grid.heights_m(), heights_m_);
}

TEST_F(LayersIo, KeepsNodataPixelInterpretationAndGeoreference) {
  std::vector<double> heights_m(1200);
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    heights_m[i] = i % 7 == 0 ? -9999 : std::sin(static_cast<double>(i)) * 100;
  for (const char* kind : {"Area", "Point"}) {
    for (const double nodata : {-9999.0, -32768.0}) {
      testing::GeoTiff{.size = {40, 30}, .values = heights_m, .crs = "EPSG:26915", .nodata = nodata}
          .save(folder_ / "in.tif");
      {
        const std::unique_ptr<void, decltype(&GDALClose)> file(
            GDALOpen((folder_ / "in.tif").c_str(), GA_Update), &GDALClose);
        GDALSetMetadataItem(file.get(), "AREA_OR_POINT", kind, nullptr);
      }
      const Dem dem = load_dem(folder_ / "in.tif");
      const RasterForm form = read_form(folder_ / "in.tif");
      EXPECT_EQ(form.nodata, nodata);
      EXPECT_EQ(form.is_point, std::string(kind) == "Point");
      const RasterLayer layer{"elevation", "m", dem.grid.heights_m()};
      write_layers(file_, dem.grid.frame(), {.origin_w_m = dem.origin_w_m, .crs_wkt = dem.crs_wkt},
                   {&layer, 1}, form);
      const Dem again = load_dem(file_);
      EXPECT_EQ(again.crs_name, dem.crs_name);
      EXPECT_EQ(again.origin_w_m, dem.origin_w_m);
      EXPECT_EQ(again.grid.origin_m(), dem.grid.origin_m());
      EXPECT_EQ(again.grid.step_m(), dem.grid.step_m());
      expect_same(again.grid.heights_m(), dem.grid.heights_m());
      // The second file has heights of -9999 and holes of -32768: both keep their values.
      EXPECT_EQ(read_form(file_).nodata, nodata);
      EXPECT_EQ(read_form(file_).is_point, form.is_point);
    }
  }
}

TEST_F(LayersIo, HeightsEqualToNodataDoNotBecomeHoles) {
  heights_m_[0] = 0;
  for (const double nodata : {0.0, 0.1, 1e300}) {  // a height; not a float; too large for a float
    write_layers(file_, frame_, place_,
                 std::vector<RasterLayer>{{"counts", "", counts_}, {"elevation", "m", heights_m_}},
                 {.nodata = nodata});
    EXPECT_TRUE(std::isnan(*read_form(file_).nodata)) << nodata;
    write_layers(file_, frame_, place_, std::vector<RasterLayer>{{"elevation", "m", heights_m_}},
                 {.nodata = nodata});
    expect_same(load_dem(file_).grid.heights_m(), heights_m_);
  }
}

// Heights are in metres, regardless of the datum's own unit; the datum is kept.
TEST_F(LayersIo, KeepsTheVerticalDatumAndWritesMetres) {
  const std::vector<RasterLayer> layers{{"elevation", "m", heights_m_}};
  for (const char* crs : {"EPSG:26915+5703", "EPSG:26915+6360"}) {  // NAVD88 in m and in US feet
    OGRSpatialReference both;
    ASSERT_EQ(both.SetFromUserInput(crs), OGRERR_NONE);
    char* text = nullptr;
    both.exportToWkt(&text);
    place_.crs_wkt = text;
    CPLFree(text);
    write_layers(file_, frame_, place_, layers);
    const Dem dem = load_dem(file_);
    expect_same(dem.grid.heights_m(), heights_m_);
    EXPECT_THAT(dem.crs_name, AllOf(HasSubstr("UTM zone 15N"),
                                    AnyOf(HasSubstr("NAVD88 height"),
                                          HasSubstr("North American Vertical Datum 1988 height"))));
    OGRSpatialReference read;
    ASSERT_EQ(read.SetFromUserInput(dem.crs_wkt.c_str()), OGRERR_NONE);
    EXPECT_EQ(read.GetTargetLinearUnits("VERT_CS"), 1) << crs;
  }
}

TEST_F(LayersIo, WritesNorthUpForAnyDirectionOfTheFrame) {
  GridFrame turned = frame_;
  turned.origin_m = {2, -1.5};
  turned.step_m = {-2, 3};
  write_layers(file_, turned, place_, std::vector<RasterLayer>{{"elevation", "m", counts_}});
  const Dem dem = load_dem(file_);
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(2, -3));
  EXPECT_EQ(dem.grid.origin_m() + glm::dvec2(dem.origin_w_m),
            frame_.origin_m + glm::dvec2(place_.origin_w_m));
  EXPECT_THAT(dem.grid.heights_m(), ElementsAre(16777216, 2, 1, 3, 0, 7));
}

TEST_F(LayersIo, NamesEachBandAndKeepsTheCrs) {
  OGRSpatialReference utm;
  utm.importFromEPSG(32631);
  char* text = nullptr;
  utm.exportToWkt(&text);
  place_.crs_wkt = text;
  CPLFree(text);
  write_layers(file_, frame_, place_,
               std::vector<RasterLayer>{{"elevation", "m", heights_m_}, {"n_lidar", "", counts_}});
  EXPECT_THAT(load_dem(file_).crs_name, HasSubstr("UTM zone 31N"));
  const GDALDatasetUniquePtr opened(GDALDataset::Open(file_.c_str()));
  ASSERT_EQ(opened->GetRasterCount(), 2);
  EXPECT_STREQ(opened->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  GDALRasterBand& counts = *opened->GetRasterBand(2);
  EXPECT_STREQ(counts.GetDescription(), "n_lidar");
  EXPECT_TRUE(std::isnan(counts.GetNoDataValue()));
  std::vector<float> read(6);
  ASSERT_EQ(counts.RasterIO(GF_Read, 0, 0, 3, 2, read.data(), 3, 2, GDT_Float32, 0, 0, nullptr),
            CE_None);
  EXPECT_EQ(read, counts_);
}

TEST_F(LayersIo, WritesBytesNorthUpWithTheirNodataValue) {
  const std::vector<std::uint8_t> flags{0, 1, 255, 4, 9, 2};
  for (const double direction : {1.0, -1.0}) {
    GridFrame frame = frame_;
    frame.origin_m = direction * frame_.origin_m;
    frame.step_m = direction * frame_.step_m;
    write_byte_layer(file_, frame, place_, "verdict", flags, 255);
    const GDALDatasetUniquePtr opened(GDALDataset::Open(file_.c_str()));
    ASSERT_EQ(opened->GetRasterCount(), 1);
    GDALRasterBand& band = *opened->GetRasterBand(1);
    EXPECT_EQ(band.GetRasterDataType(), GDT_Byte);
    EXPECT_EQ(band.GetNoDataValue(), 255);
    EXPECT_STREQ(band.GetDescription(), "verdict");
    std::vector<std::uint8_t> read(6);
    ASSERT_EQ(band.RasterIO(GF_Read, 0, 0, 3, 2, read.data(), 3, 2, GDT_Byte, 0, 0, nullptr),
              CE_None);
    std::vector<std::uint8_t> expected = flags;
    if (direction < 0) std::ranges::reverse(expected);
    EXPECT_EQ(read, expected);
  }
  EXPECT_THROW(write_byte_layer(file_, frame_, place_, "verdict", std::span(flags).first(4), 255),
               Error);
}

TEST_F(LayersIo, RejectsLayersOfWrongSize) {
  EXPECT_THAT(error_of(frame_, {}), HasSubstr("there are no layers"));
  place_.origin_w_m.z = 3;
  const std::vector<RasterLayer> shorter{{"elevation", "m", std::span(heights_m_).first(4)}};
  EXPECT_THAT(error_of(frame_, shorter), AllOf(HasSubstr("elevation has 4 values for 6 samples"),
                                               HasSubstr("origin is 3 m; it must be 0")));
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(LayersIo, ReportsWhichFileCannotBeWritten) {
  file_ = folder_ / "none" / "layers.tif";
  const std::vector<RasterLayer> layers{{"elevation", "m", heights_m_}};
  EXPECT_THAT(error_of(frame_, layers), HasSubstr("none/layers.tif"));
}

}  // namespace
}  // namespace groundray::layers_io_test
