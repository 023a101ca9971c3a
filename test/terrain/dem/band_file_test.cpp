#include "terrain/dem/band_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/error.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"

namespace groundray::band_file_test {
namespace {

using ::testing::AllOf;
using testing::GeoTiff;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

// Two bands; sample (column, row) of band b is 100 b + 10 row + column.
GeoTiff two_bands() {
  GeoTiff file{.size = {7, 5}, .nodata = 123};
  for (int band = 0; band < 2; ++band) {
    for (int row = 0; row < 5; ++row) {
      for (int column = 0; column < 7; ++column)
        file.values.push_back(100 * band + 10 * row + column);
    }
  }
  return file;
}

TEST(BandFile, ReadsAllBands) {
  const TemporaryFolder folder;
  two_bands().save(folder / "two.tif");
  const RasterBands bands = read_bands(folder / "two.tif", 1000);
  EXPECT_EQ(bands.samples, glm::ivec2(7, 5));
  EXPECT_EQ(bands.step, 1);
  ASSERT_EQ(bands.bands.size(), 2u);
  EXPECT_EQ(bands.bands[1].name, "band 2");
  EXPECT_EQ(bands.bands[1].values[7 * 3 + 4], 134);
  // Sample (3, 2) of the second band equals the declared nodata value.
  EXPECT_TRUE(std::isnan(bands.bands[1].values[7 * 2 + 3]));
}

TEST(BandFile, SubsamplesByIntegerSteps) {
  const TemporaryFolder folder;
  two_bands().save(folder / "two.tif");
  const RasterBands bands = read_bands(folder / "two.tif", 12);
  EXPECT_EQ(bands.step, 2);
  EXPECT_EQ(bands.samples, glm::ivec2(4, 3));
  EXPECT_THAT(bands.bands[0].values,
              ::testing::ElementsAre(0, 2, 4, 6, 20, 22, 24, 26, 40, 42, 44, 46));
}

TEST(BandFile, ReadsAtMostTheRequestedBands) {
  const TemporaryFolder folder;
  two_bands().save(folder / "two.tif");
  EXPECT_EQ(read_bands(folder / "two.tif", 1000, 1).bands.size(), 1u);
  EXPECT_EQ(read_bands(folder / "two.tif", 1000, 9).bands.size(), 2u);
}

// 300 bands of 4 million samples need 4.8 GB; they are rejected before any sample is read.
TEST(BandFile, RejectsRastersLargerThanTheMemoryLimit) {
  const TemporaryFolder folder;
  std::ofstream vrt(folder / "many.vrt");
  vrt << "<VRTDataset rasterXSize=\"2000\" rasterYSize=\"2000\">";
  for (int band = 1; band <= 300; ++band)
    vrt << "<VRTRasterBand dataType=\"Float32\" band=\"" << band << "\"/>";
  vrt << "</VRTDataset>";
  vrt.close();
  EXPECT_THAT([&] { read_bands(folder / "many.vrt", 4'000'000); },
              ThrowsMessage<Error>(AllOf(HasSubstr("many.vrt"), HasSubstr("300 bands"))));
  EXPECT_EQ(read_bands(folder / "many.vrt", 10'000, 5).bands.size(), 5u);
  EXPECT_THAT([&] { read_bands(folder / "many.vrt", 0); },
              ThrowsMessage<Error>(HasSubstr("1 or more")));
}

TEST(BandFile, AppliesScaleAndOffset) {
  const TemporaryFolder folder;
  GeoTiff file = two_bands();
  file.nodata.reset();
  file.scale = 0.5;
  file.offset = -3;
  file.save(folder / "scaled.tif");
  EXPECT_EQ(read_bands(folder / "scaled.tif", 1000).bands[0].values[8], 0.5 * 11 - 3);
}

TEST(BandFile, DistinguishesKindsOfRasters) {
  const TemporaryFolder folder;
  two_bands().save(folder / "two.tif");
  RasterKind kind = inspect_raster(folder / "two.tif");
  EXPECT_EQ(kind.samples, glm::ivec2(7, 5));
  EXPECT_EQ(kind.bands, 2);
  EXPECT_FALSE(kind.is_picture);
  EXPECT_FALSE(kind.is_geographic);
  GeoTiff photo{.size = {3, 2}, .crs = "EPSG:4326", .type = GDT_Byte};
  photo.values.assign(18, 9);
  photo.save(folder / "photo.tif");
  kind = inspect_raster(folder / "photo.tif");
  EXPECT_TRUE(kind.is_picture);
  EXPECT_TRUE(kind.is_geographic);
}

TEST(BandFile, ReportsTheFile) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { read_bands(folder / "absent.tif", 10); },
              ThrowsMessage<Error>(HasSubstr("absent.tif")));
  GeoTiff waves = two_bands();
  waves.type = GDT_CFloat32;
  waves.nodata.reset();
  waves.save(folder / "waves.tif");
  EXPECT_THAT([&] { read_bands(folder / "waves.tif", 100); },
              ThrowsMessage<Error>(HasSubstr("complex")));
}

}  // namespace
}  // namespace groundray::band_file_test
