#include "terrain/dem/dem_file.h"

#include <gdal.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"

namespace groundray::dem_file_test {
namespace {

using testing::GeoTiff;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing::TemporaryFolder;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

glm::dvec2 uniform(std::uint32_t index, std::uint32_t of = 0) {
  return random_uniform({.seed = {3}, .pulse = index, .sub_ray = of});
}

// Integers from -2000 to 2000, with some -99.
std::vector<double> some_values(glm::ivec2 size) {
  std::vector<double> values;
  for (int i = 0; i < size.x * size.y; ++i) {
    const glm::dvec2 number = uniform(static_cast<std::uint32_t>(i));
    values.push_back(number.y < 0.1 ? -99 : std::floor(number.x * 4001) - 2000);
  }
  return values;
}

struct Window {
  glm::ivec2 first;
  glm::ivec2 size;
};

// The whole raster, single samples, whole rows and columns, and random windows.
std::vector<Window> windows(glm::ivec2 samples) {
  std::vector<Window> all{{{0, 0}, samples},
                          {samples - 1, {1, 1}},
                          {{0, samples.y / 2}, {samples.x, 1}},
                          {{samples.x / 3, 0}, {1, samples.y}}};
  for (std::uint32_t i = 0; i < 40; ++i) {
    const glm::ivec2 first(uniform(i, 1) * glm::dvec2(samples));
    const glm::ivec2 size(uniform(i, 2) * glm::dvec2(samples - first));
    all.push_back({first, size + glm::ivec2(size.x == 0, size.y == 0)});
  }
  return all;
}

std::vector<float> cut_out(const HeightGrid& grid, const Window& window) {
  std::vector<float> heights;
  for (int row = window.first.y; row < window.first.y + window.size.y; ++row) {
    for (int column = window.first.x; column < window.first.x + window.size.x; ++column) {
      heights.push_back(grid.height_m(column, row));
    }
  }
  return heights;
}

// Bitwise comparison that includes NaN: load_dem gives all NaNs the same bits.
bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

void expect_same_as_loaded(const std::filesystem::path& path, const DemOptions& options = {}) {
  const Dem dem = load_dem(path, options);
  const DemFile file(path, options);
  const DemHeader& header = file.header();
  ASSERT_EQ(header.samples, glm::ivec2(dem.grid.columns(), dem.grid.rows()));
  EXPECT_EQ(header.origin_m, dem.grid.origin_m());
  EXPECT_EQ(header.step_m, dem.grid.step_m());
  EXPECT_EQ(header.origin_w_m, dem.origin_w_m);
  EXPECT_EQ(header.crs_wkt, dem.crs_wkt);
  EXPECT_EQ(header.crs_name, dem.crs_name);
  for (const Window& window : windows(header.samples)) {
    EXPECT_TRUE(same_bits(file.read(window.first, window.size), cut_out(dem.grid, window)))
        << path << " " << window.first.x << " " << window.first.y << " " << window.size.x << " "
        << window.size.y;
  }
}

std::string error_of(const auto& work) {
  ::testing::internal::CaptureStderr();
  std::string message = "no error";
  try {
    work();
  } catch (const Error& error) {
    message = error.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  return message;
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path) << text;
}

void write_mosaic(const std::filesystem::path& path, glm::ivec2 size) {
  write_text(path, fmt::format(R"(<VRTDataset rasterXSize="{0}" rasterYSize="{1}">
    <GeoTransform>0, 10, 0, 20, 0, -10</GeoTransform>
    <VRTRasterBand dataType="Float32" band="1"><SimpleSource>
      <SourceFilename relativeToVRT="1">dem.tif</SourceFilename><SourceBand>1</SourceBand>
      <SourceProperties RasterXSize="301" RasterYSize="270" DataType="Float32"
        BlockXSize="301" BlockYSize="6"/>
    </SimpleSource></VRTRasterBand></VRTDataset>)",
                               size.x, size.y));
}

class DemFileTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path tiff_ = folder_ / "dem.tif";
  GeoTiff picture_{.size = {301, 270}, .values = some_values({301, 270})};
  std::vector<const char*> tiles_{"TILED=YES", "BLOCKXSIZE=64", "BLOCKYSIZE=32",
                                  "COMPRESS=DEFLATE"};
};

TEST_F(DemFileTest, WindowsEqualTheLoadedDemBitForBit) {
  picture_.save(tiff_);  // in strips
  expect_same_as_loaded(tiff_);
  picture_.options = tiles_;
  picture_.save(tiff_);
  expect_same_as_loaded(tiff_);
  expect_same_as_loaded(tiff_, {.nodata = -99});
  write_mosaic(folder_ / "dem.vrt", picture_.size);
  expect_same_as_loaded(folder_ / "dem.vrt", {.nodata = 7});
}

TEST_F(DemFileTest, WindowsApplyNodataScaleAndOffset) {
  picture_.type = GDT_Int16;
  picture_.nodata = -99;
  picture_.scale = 0.1;
  picture_.offset = 12.3;
  picture_.options = tiles_;
  picture_.crs = "EPSG:26915+6360";  // heights in US survey feet
  picture_.save(tiff_);
  expect_same_as_loaded(tiff_, {.nodata = 1000});
}

TEST_F(DemFileTest, WindowsApplyMaskAndAlpha) {
  picture_.options = tiles_;
  picture_.has_mask = true;
  picture_.save(tiff_);
  expect_same_as_loaded(tiff_);
  GeoTiff with_alpha{.size = picture_.size, .values = picture_.values, .has_alpha = true};
  for (const double value : picture_.values) with_alpha.values.push_back(value < 0 ? 0 : 255);
  with_alpha.save(folder_ / "alpha.tif");
  expect_same_as_loaded(folder_ / "alpha.tif");
  EXPECT_GT(load_dem(folder_ / "alpha.tif").grid.hole_count(), 1000u);
}

TEST_F(DemFileTest, ReprojectedWindowsEqualTheReprojectedDemBitForBit) {
  picture_.size = {700, 400};  // more than one block of the warp
  picture_.values = some_values(picture_.size);
  picture_.geotransform = {6, 1.0 / 1200, 0, 46, 0, -1.0 / 1200};
  picture_.crs = "EPSG:4326";
  picture_.nodata = -99;
  picture_.scale = 0.3;
  picture_.save(tiff_);
  expect_same_as_loaded(tiff_, {.nodata = 7, .reproject_to = "utm"});
  expect_same_as_loaded(tiff_, {.reproject_to = "EPSG:3035"});
}

TEST_F(DemFileTest, ReprojectionReportsAnInfiniteHeight) {
  picture_.values[301 * 5 + 17] = std::numeric_limits<double>::infinity();
  picture_.geotransform = {6, 0.001, 0, 46, 0, -0.001};
  picture_.crs = "EPSG:4326";
  picture_.save(tiff_);
  EXPECT_THAT(error_of([&] { load_dem(tiff_, {.reproject_to = "utm"}); }),
              ::testing::AllOf(StartsWith(tiff_.string() + ": "),
                               HasSubstr("the height in column 17, row 5 is infinite")));
}

// 10^10 samples: five times the number that fits into memory.
TEST_F(DemFileTest, ReadsFilesLargerThanMemory) {
  picture_.save(tiff_);
  write_mosaic(folder_ / "huge.vrt", {100'000, 100'000});
  const DemFile file(folder_ / "huge.vrt");
  EXPECT_EQ(file.header().samples, glm::ivec2(100'000));
  EXPECT_EQ(file.read({99'990, 99'990}, {10, 10}), std::vector<float>(100, 0));
  const Dem part = load_dem(tiff_);
  EXPECT_TRUE(
      same_bits(file.read({200, 100}, {90, 80}), cut_out(part.grid, {{200, 100}, {90, 80}})));
  EXPECT_THAT(error_of([&] { load_dem(folder_ / "huge.vrt"); }),
              HasSubstr("more than the limit of"));
  EXPECT_LE(GDALGetCacheMax64(), 64 << 20);
}

TEST_F(DemFileTest, RejectsSidesOfMoreThan2To30Samples) {
  picture_.save(tiff_);
  write_mosaic(folder_ / "wide.vrt", {(1 << 30) + 1, 2});
  EXPECT_THAT(
      error_of([&] { DemFile(folder_ / "wide.vrt"); }),
      HasSubstr("it has 1073741825 x 2 samples, more than the limit of 1073741824 per side"));
}

TEST_F(DemFileTest, RejectsWindowsOutsideTheGrid) {
  picture_.save(tiff_);
  const DemFile file(tiff_);
  for (const Window& window : std::vector<Window>{{{-1, 0}, {2, 2}},
                                                  {{0, 0}, {302, 1}},
                                                  {{300, 269}, {1, 2}},
                                                  {{0, 0}, {0, 1}},
                                                  {{1, 1}, {std::numeric_limits<int>::max(), 1}}}) {
    EXPECT_THAT(error_of([&] { file.read(window.first, window.size); }),
                ::testing::AllOf(StartsWith(tiff_.string() + ": a window of"),
                                 HasSubstr("exceeds its 301 x 270 samples")));
  }
}

TEST_F(DemFileTest, ReadErrorsReportFileAndWindow) {
  picture_.options = {"TILED=YES", "BLOCKXSIZE=64", "BLOCKYSIZE=64"};
  picture_.save(tiff_);
  const DemFile file(tiff_);
  std::filesystem::resize_file(tiff_, std::filesystem::file_size(tiff_) / 2);
  EXPECT_NO_THROW(file.read({0, 0}, {64, 64}));
  EXPECT_THAT(error_of([&] {
                file.read({200, 250}, {50, 20});
              }),
              ::testing::AllOf(StartsWith(tiff_.string() + ": its samples in columns 200 to 249, "
                                                           "rows 250 to 25"),
                               HasSubstr("was the file cut short?")));
  EXPECT_THAT(error_of([&] { DemFile(folder_ / "missing.tif"); }),
              HasSubstr("missing.tif: there is no such file"));
}

TEST_F(DemFileTest, ManyThreadsReadTheSameHeightsAsOne) {
  picture_.options = tiles_;
  picture_.save(tiff_);
  const DemFile file(tiff_);
  const Dem dem = load_dem(tiff_);
  std::vector<int> wrong(4, 0);
  std::vector<std::jthread> threads;
  for (int& count : wrong) {
    threads.emplace_back([&] {
      for (const Window& window : windows(file.header().samples)) {
        count += !same_bits(file.read(window.first, window.size), cut_out(dem.grid, window));
      }
    });
  }
  threads.clear();
  EXPECT_THAT(wrong, ::testing::Each(0));
}

TEST_F(DemFileTest, HandlesOfOneMosaicCanBeUsedConcurrently) {
  picture_.options = tiles_;
  picture_.save(tiff_);
  write_mosaic(folder_ / "dem.vrt", picture_.size);
  const Dem dem = load_dem(tiff_);
  std::vector<DemFile> files;
  for (int i = 0; i < 4; ++i) files.emplace_back(folder_ / "dem.vrt");
  std::vector<std::string> faults(files.size());
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < files.size(); ++i) {
    threads.emplace_back([&, i] {
      try {
        for (const Window& window : windows(files[i].header().samples)) {
          const auto part = files[i].read(window.first, window.size);
          if (!same_bits(part, cut_out(dem.grid, window))) faults[i] = "other heights";
        }
      } catch (const Error& error) {
        faults[i] = error.what();
      }
    });
  }
  threads.clear();
  EXPECT_THAT(faults, ::testing::Each(""));
}

TEST_F(DemFileTest, EqualFilesHaveEqualFingerprints) {
  picture_.save(tiff_);
  const std::string print = DemFile(tiff_).fingerprint();
  EXPECT_EQ(DemFile(tiff_).fingerprint(), print);
  const auto relative = std::filesystem::relative(tiff_);
  ASSERT_TRUE(relative.is_relative());
  EXPECT_EQ(DemFile(relative).fingerprint(), print);
  // Auxiliary files that viewers write do not change the fingerprint.
  write_text(folder_ / "dem.tif.aux.xml",
             "<PAMDataset><Metadata><MDI key=\"a\">b</MDI></Metadata></PAMDataset>");
  EXPECT_EQ(DemFile(tiff_).fingerprint(), print);
}

TEST_F(DemFileTest, FingerprintDependsOnOptionsHeaderTimeAndHeights) {
  picture_.save(tiff_);
  std::vector<std::string> prints{DemFile(tiff_).fingerprint(),
                                  DemFile(tiff_, {.nodata = 5}).fingerprint(),
                                  DemFile(tiff_, {.reproject_to = "utm"}).fingerprint()};
  const auto time = std::filesystem::last_write_time(tiff_);
  const auto note = [&] { prints.push_back(DemFile(tiff_).fingerprint()); };
  std::filesystem::last_write_time(tiff_, time + std::chrono::nanoseconds(1));
  note();
  const auto note_at_that_time = [&] {
    picture_.save(tiff_);
    std::filesystem::last_write_time(tiff_, time);
    note();
  };
  for (double& value : picture_.values) value += 1;
  note_at_that_time();
  picture_.geotransform[0] += 1;
  note_at_that_time();
  picture_.crs = "EPSG:32632";
  note_at_that_time();
  picture_.nodata = 12;
  note_at_that_time();
  std::ranges::sort(prints);
  EXPECT_EQ(std::ranges::adjacent_find(prints), prints.end());
}

TEST_F(DemFileTest, FingerprintOfAMosaicDependsOnItsParts) {
  picture_.save(tiff_);
  write_mosaic(folder_ / "dem.vrt", picture_.size);
  const std::string print = DemFile(folder_ / "dem.vrt").fingerprint();
  EXPECT_EQ(DemFile(folder_ / "dem.vrt").fingerprint(), print);
  const auto time = std::filesystem::last_write_time(tiff_);
  std::filesystem::last_write_time(tiff_, time + std::chrono::seconds(1));
  EXPECT_NE(DemFile(folder_ / "dem.vrt").fingerprint(), print);
  std::filesystem::last_write_time(tiff_, time);
  EXPECT_EQ(DemFile(folder_ / "dem.vrt").fingerprint(), print);
  std::ranges::fill(picture_.values, missing);
  picture_.save(tiff_);
  std::filesystem::last_write_time(tiff_, time);
  EXPECT_NE(DemFile(folder_ / "dem.vrt").fingerprint(), print);
}

}  // namespace
}  // namespace groundray::dem_file_test
