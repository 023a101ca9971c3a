#include "terrain/layers_io.h"

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <vector>

#include "core/error.h"
#include "terrain/dem_io.h"
#include "test/support/temporary_folder.h"

namespace groundray {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr float hole = std::numeric_limits<float>::quiet_NaN();

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

TEST_F(LayersIo, ReadsItsElevationsAgain) {
  write_layers(file_, frame_, place_,
               std::vector<RasterLayer>{{"elevation", "m", heights_m_}, {"n_lidar", "", counts_}});
  const Dem dem = load_dem(file_);
  EXPECT_EQ(dem.crs_name, "local (no CRS)");
  EXPECT_EQ(dem.grid.columns(), 3);
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(2, -3));
  EXPECT_EQ(dem.grid.origin_m() + glm::dvec2(dem.origin_w_m),
            frame_.origin_m + glm::dvec2(place_.origin_w_m));
  for (std::size_t i = 0; i < heights_m_.size(); ++i) {
    const float read = dem.grid.heights_m()[i];
    EXPECT_TRUE(read == heights_m_[i] || (std::isnan(read) && std::isnan(heights_m_[i])));
  }
}

TEST_F(LayersIo, PutsNorthAndWestFirstWhicheverWayTheFrameRuns) {
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

TEST_F(LayersIo, NamesEachBandAndKeepsTheSystemOfCoordinates) {
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

TEST_F(LayersIo, RefusesLayersThatDoNotFit) {
  EXPECT_THAT(error_of(frame_, {}), HasSubstr("there is none"));
  place_.origin_w_m.z = 3;
  const std::vector<RasterLayer> shorter{{"elevation", "m", std::span(heights_m_).first(4)}};
  EXPECT_THAT(error_of(frame_, shorter), AllOf(HasSubstr("elevation has 4 values for 6 samples"),
                                               HasSubstr("origin is 3 m high")));
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(LayersIo, SaysWhichFileCannotBeWritten) {
  file_ = folder_ / "none" / "layers.tif";
  const std::vector<RasterLayer> layers{{"elevation", "m", heights_m_}};
  EXPECT_THAT(error_of(frame_, layers), HasSubstr("none/layers.tif"));
}

}  // namespace
}  // namespace groundray
