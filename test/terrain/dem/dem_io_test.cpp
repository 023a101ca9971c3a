#include "terrain/dem/dem_io.h"

#include <cpl_conv.h>
#include <fmt/format.h>
#include <gdal.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "test/support/environment.h"
#include "test/support/temporary_folder.h"

namespace groundray::dem_io_test {
namespace {

using ::testing::ElementsAre;
using testing::Environment;
using ::testing::HasSubstr;
using ::testing::IsNan;
using ::testing::Not;
using ::testing::Pointwise;
using testing::shared_data_folder;
using testing::TemporaryFolder;

constexpr float hole = std::numeric_limits<float>::quiet_NaN();
constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr std::array utm_transform{500000.25, 2.0, 0.0, 5150000.75, 0.0, -3.0};
constexpr const char* utm_31 = "EPSG:32631";

using Dataset = std::unique_ptr<void, decltype(&GDALClose)>;

// Description of a raster file, written through GDAL's C API.
struct Picture {
  int columns = 3;
  int rows = 2;
  std::vector<double> values{1, 2, 3, 4, 5, 6};  // band by band
  std::optional<std::array<double, 6>> geotransform = utm_transform;
  std::string crs = utm_31;
  GDALDataType type = GDT_Float32;
  std::optional<double> nodata;
  std::string unit;
  double scale = 1;
  double offset = 0;

  void save_tiff(const std::filesystem::path& path) const { made_by("GTiff", path); }
  void save_as(const char* driver, const std::filesystem::path& path,
               std::vector<const char*> options = {}) const {
    const Dataset source = made_by("MEM", "");
    options.push_back(nullptr);
    const Dataset copy(GDALCreateCopy(GDALGetDriverByName(driver), path.c_str(), source.get(), 0,
                                      options.data(), nullptr, nullptr),
                       &GDALClose);
    if (copy == nullptr) throw std::runtime_error(std::string("GDAL cannot write ") + driver);
  }

  Dataset made_by(const char* driver, const std::filesystem::path& path) const {
    GDALAllRegister();
    const std::ptrdiff_t samples = std::ptrdiff_t{columns} * rows;
    const int bands = static_cast<int>(std::ssize(values) / samples);
    Dataset dataset(
        GDALCreate(GDALGetDriverByName(driver), path.c_str(), columns, rows, bands, type, nullptr),
        &GDALClose);
    if (geotransform) {
      auto gt = *geotransform;
      GDALSetGeoTransform(dataset.get(), gt.data());
    }
    if (!crs.empty()) {
      OGRSpatialReferenceH reference = OSRNewSpatialReference(nullptr);
      OSRSetFromUserInput(reference, crs.c_str());
      GDALSetSpatialRef(dataset.get(), reference);
      OSRDestroySpatialReference(reference);
    }
    for (int i = 0; i < bands; ++i) {
      GDALRasterBandH band = GDALGetRasterBand(dataset.get(), i + 1);
      if (nodata) GDALSetRasterNoDataValue(band, *nodata);
      if (!unit.empty()) GDALSetRasterUnitType(band, unit.c_str());
      if (scale != 1) GDALSetRasterScale(band, scale);
      if (offset != 0) GDALSetRasterOffset(band, offset);
      std::vector<double> some(values.begin() + i * samples, values.begin() + (i + 1) * samples);
      EXPECT_EQ(GDALRasterIO(band, GF_Write, 0, 0, columns, rows, some.data(), columns, rows,
                             GDT_Float64, 0, 0),
                CE_None);
    }
    return dataset;
  }
};

glm::dvec2 p_W(const Dem& dem, int column, int row) {
  return glm::dvec2(dem.origin_w_m) + dem.grid.origin_m() +
         glm::dvec2(column, row) * dem.grid.step_m();
}

std::vector<float> heights(const Dem& dem) {
  return {dem.grid.heights_m().begin(), dem.grid.heights_m().end()};
}

std::string error_of(const std::filesystem::path& path, const DemOptions& options = {}) {
  ::testing::internal::CaptureStderr();
  std::string message = "no error";
  try {
    load_dem(path, options);
  } catch (const Error& error) {
    message = error.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(message, ::testing::StartsWith(path.string() + ": "));
  return message;
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path) << text;
}

// Raw bytes of an HGT tile: big-endian 16-bit heights, row by row from the north.
void write_hgt(const std::filesystem::path& path, int samples, auto height) {
  std::string bytes;
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column) {
      const auto z = static_cast<std::uint16_t>(height(column, row));
      bytes += {static_cast<char>(z >> 8), static_cast<char>(z & 0xff)};
    }
  }
  std::ofstream(path, std::ios::binary) << bytes;
}

class DemIo : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path tiff_ = folder_ / "dem.tif";
};

TEST_F(DemIo, SamplesAreAtPixelCentres) {
  Picture{}.save_tiff(tiff_);
  const Dem dem = load_dem(tiff_);
  EXPECT_EQ(dem.grid.columns(), 3);
  EXPECT_EQ(dem.grid.rows(), 2);
  EXPECT_THAT(heights(dem), ElementsAre(1, 2, 3, 4, 5, 6));
  // Centre of the raster: 500000.25 + 3 * 2 / 2, 5150000.75 - 2 * 3 / 2; rounded to whole metres.
  EXPECT_EQ(dem.origin_w_m, glm::dvec3(500003, 5149998, 0));
  EXPECT_EQ(dem.grid.origin_m(), glm::dvec2(500001.25 - 500003, 5149999.25 - 5149998));
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(2, -3));
  EXPECT_EQ(dem.crs_name, "WGS 84 / UTM zone 31N (EPSG:32631)");
  EXPECT_THAT(dem.crs_wkt, HasSubstr("PROJCRS[\"WGS 84 / UTM zone 31N\""));
}

TEST_F(DemIo, PixelIsPointTiffHasItsFirstSampleAtTheTiepoint) {
  // With this option GDAL ignores the distinction: it writes its origin as the tiepoint and
  // declares it a point.
  CPLSetConfigOption("GTIFF_POINT_GEO_IGNORE", "YES");
  {
    const Dataset dataset = Picture{}.made_by("GTiff", tiff_);
    GDALSetMetadataItem(dataset.get(), "AREA_OR_POINT", "Point", nullptr);
  }
  CPLSetConfigOption("GTIFF_POINT_GEO_IGNORE", nullptr);
  EXPECT_EQ(p_W(load_dem(tiff_), 0, 0), glm::dvec2(500000.25, 5150000.75));
}

TEST_F(DemIo, RowsMayRunNorthwards) {
  Picture{.geotransform = std::array{0.0, 2.0, 0.0, 100.0, 0.0, 3.0}}.save_tiff(tiff_);
  const Dem dem = load_dem(tiff_);
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(2, 3));
  EXPECT_EQ(p_W(dem, 2, 1), glm::dvec2(5, 104.5));
}

TEST_F(DemIo, DeclaredAndGivenNodataAndNanAreHoles) {
  Picture{.values = {1, -9999, missing, -32767, 5, 6}, .nodata = -9999}.save_tiff(tiff_);
  EXPECT_THAT(heights(load_dem(tiff_)), ElementsAre(1, IsNan(), IsNan(), -32767, 5, 6));
  EXPECT_THAT(heights(load_dem(tiff_, {.nodata = -32767})),
              ElementsAre(1, IsNan(), IsNan(), IsNan(), 5, 6));
}

TEST_F(DemIo, MatchesNodataRoundedFromTheLowestFloat) {
  const double lowest = std::numeric_limits<float>::lowest();
  Picture{.values = {1, 2, 3, lowest, 5, 6}, .nodata = -3.4028234663852886e+38}.save_tiff(tiff_);
  EXPECT_THAT(heights(load_dem(tiff_)), ElementsAre(1, 2, 3, IsNan(), 5, 6));
}

TEST_F(DemIo, AlphaBandMarksHoles) {
  {
    const Dataset dataset =
        Picture{.values = {1, 2, 3, 4, 5, 6, 255, 0, 255, 255, 255, 0}}.made_by("GTiff", tiff_);
    GDALSetRasterColorInterpretation(GDALGetRasterBand(dataset.get(), 2), GCI_AlphaBand);
  }
  EXPECT_THAT(heights(load_dem(tiff_)), ElementsAre(1, IsNan(), 3, 4, 5, IsNan()));
}

TEST_F(DemIo, AppliesScaleAndOffsetAndComparesNodataWithStoredValues) {
  Picture{.values = {0, 1, 2, 3, 65535, 5},
          .type = GDT_UInt16,
          .nodata = 65535,
          .scale = 0.5,
          .offset = -100}
      .save_tiff(tiff_);
  EXPECT_THAT(heights(load_dem(tiff_, {.nodata = 1})),
              ElementsAre(-100, IsNan(), -99, -98.5f, IsNan(), -97.5f));
}

TEST_F(DemIo, ConvertsFeetToMetres) {
  for (const auto& [unit, metres] : {std::pair{"ft", 0.3048},
                                     {"US survey foot", 1200.0 / 3937},
                                     {"Feet", 0.3048},
                                     {"ftUS", 1200.0 / 3937},
                                     {"us-ft", 1200.0 / 3937},
                                     {"cm", 0.01},
                                     {"metre", 1.0}}) {
    Picture{.values = {1000, 1000, 1000, 1000, 1000, 1000}, .unit = unit}.save_tiff(tiff_);
    EXPECT_EQ(load_dem(tiff_).grid.height_m(1, 1), static_cast<float>(1000 * metres)) << unit;
  }
  // NAVD88 height (ftUS)
  Picture{.values = {1000, 1000, 1000, 1000, 1000, 1000}, .crs = "EPSG:26915+6360"}.save_tiff(
      tiff_);
  const Dem dem = load_dem(tiff_);
  EXPECT_EQ(dem.grid.height_m(1, 1), static_cast<float>(1000 * 1200.0 / 3937));
  OGRSpatialReference crs;  // of the heights in memory
  ASSERT_EQ(crs.SetFromUserInput(dem.crs_wkt.c_str()), OGRERR_NONE);
  EXPECT_EQ(crs.GetTargetLinearUnits("VERT_CS"), 1);
  EXPECT_THAT(dem.crs_wkt, HasSubstr("North American Vertical Datum 1988"));
  EXPECT_THAT(dem.crs_name, Not(HasSubstr("ftUS")));
  EXPECT_TRUE(is_same_crs("EPSG:26915+6360", dem.crs_wkt));
}

TEST_F(DemIo, Reads64BitIntegers) {
  Picture{.values = {1, 2, 3, -9999, 5, 6}, .type = GDT_Int64, .nodata = -9999}.save_tiff(tiff_);
  EXPECT_THAT(heights(load_dem(tiff_)), ElementsAre(1, 2, 3, IsNan(), 5, 6));
}

TEST_F(DemIo, ReadsAnEsriAsciiGrid) {
  // xllcorner and yllcorner are the outer corner of the south-western cell.
  write_text(folder_ / "dem.asc",
             "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n1 2 "
             "3\n4 -9999 6.5\n");
  const Dem dem = load_dem(folder_ / "dem.asc");
  EXPECT_THAT(heights(dem), ElementsAre(1, 2, 3, 4, IsNan(), 6.5f));
  EXPECT_EQ(p_W(dem, 0, 0), glm::dvec2(105, 215));
  EXPECT_EQ(p_W(dem, 2, 1), glm::dvec2(125, 205));
  EXPECT_EQ(dem.crs_name, "local (no CRS)");
  EXPECT_EQ(dem.crs_wkt, "");
}

TEST_F(DemIo, ReadsA16BitPngNorthUp) {
  Picture{
      .values = {0, 1, 256, 32768, 65534, 65535}, .geotransform = {}, .crs = "", .type = GDT_UInt16}
      .save_as("PNG", folder_ / "dem.png");
  const Dem dem = load_dem(folder_ / "dem.png");
  EXPECT_THAT(heights(dem), ElementsAre(0, 1, 256, 32768, 65534, 65535));
  EXPECT_EQ(dem.crs_name, "local (no CRS)");
  EXPECT_EQ(p_W(dem, 0, 0), glm::dvec2(0.5, 1.5));
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(1, -1));
}

TEST_F(DemIo, ReadsAVirtualMosaic) {
  Picture{}.save_tiff(tiff_);
  write_text(folder_ / "dem.vrt", R"(<VRTDataset rasterXSize="3" rasterYSize="2">
    <GeoTransform>0, 10, 0, 20, 0, -10</GeoTransform>
    <VRTRasterBand dataType="Float32" band="1"><SimpleSource>
      <SourceFilename relativeToVRT="1">dem.tif</SourceFilename><SourceBand>1</SourceBand>
    </SimpleSource></VRTRasterBand></VRTDataset>)");
  const Dem dem = load_dem(folder_ / "dem.vrt");
  EXPECT_THAT(heights(dem), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ(p_W(dem, 0, 0), glm::dvec2(5, 15));
}

TEST_F(DemIo, ReadsNetCdfIfPermitted) {
  Picture{.values = {1, 2, missing, 4, 5, 6}, .nodata = missing}.save_as("netCDF",
                                                                         folder_ / "dem.nc");
  EXPECT_THAT(error_of(folder_ / "dem.nc"), HasSubstr("it is in none of the formats GTiff, VRT, "));
  EXPECT_THAT(error_of(folder_ / "dem.nc"),
              HasSubstr(fmt::format("gdal_translate {0}.nc {0}_converted.tif",
                                    (folder_ / "dem").string())));
  const Environment permission("GROUNDRAY_RASTER_DRIVERS", "GRIB, netCDF");
  const Dem dem = load_dem(folder_ / "dem.nc");
  EXPECT_THAT(heights(dem), ElementsAre(1, 2, IsNan(), 4, 5, 6));
  EXPECT_EQ(p_W(dem, 0, 0), glm::dvec2(500001.25, 5149999.25));
  EXPECT_THAT(dem.crs_name, HasSubstr("WGS 84 / UTM zone 31N"));
}

TEST_F(DemIo, ReadsAUsgsDem) {
  Picture picture{.columns = 40,
                  .rows = 30,
                  .values = {},
                  .geotransform = std::array{499995.0, 30.0, 0.0, 4400025.0, 0.0, -30.0},
                  .crs = "EPSG:26717",
                  .type = GDT_Int16};
  for (int i = 0; i < 1200; ++i) picture.values.push_back(100 + i);
  picture.save_as("USGSDEM", folder_ / "usgs.dem");
  const Dem dem = load_dem(folder_ / "usgs.dem");
  EXPECT_EQ(dem.grid.columns(), 40);
  EXPECT_EQ(dem.grid.rows(), 30);
  EXPECT_EQ(p_W(dem, 0, 0), glm::dvec2(500010, 4400010));
  EXPECT_EQ(dem.grid.height_m(7, 9), 100 + 7 + 40 * 9);
  EXPECT_THAT(dem.crs_wkt, HasSubstr("Transverse Mercator"));
}

// Bilinear interpolation preserves heights that are a linear function of longitude and latitude, so
// PROJ's inverse at any sample is the oracle. Tolerance: a position error of 1 % of a cell at
// slopes of 2 m and 1 m per source cell (0.03 m), and less than 1e-3 m for the curvature of the
// function over a cell.
TEST_F(DemIo, ReprojectsAnHgtTileToUtm) {
  const auto hgt = folder_ / "N45E006.hgt";
  write_hgt(hgt, 1201, [](int column, int row) { return 2 * column + row; });
  for (const char* target : {"utm", "EPSG:32632"}) {
    const Dem dem = load_dem(hgt, {.reproject_to = target});
    EXPECT_EQ(dem.crs_name, "WGS 84 / UTM zone 32N (EPSG:32632)");
    EXPECT_EQ(dem.grid.step_m().x, -dem.grid.step_m().y);
    EXPECT_NEAR(dem.grid.step_m().x, 80, 10);  // 3 seconds of arc: 92.6 m by 65.1 m
    OGRSpatialReferenceH utm = OSRNewSpatialReference(nullptr);
    OGRSpatialReferenceH geographic = OSRNewSpatialReference(nullptr);
    OSRImportFromEPSG(utm, 32632);
    OSRImportFromEPSG(geographic, 4326);  // latitude first
    OGRCoordinateTransformationH to_geographic = OCTNewCoordinateTransformation(utm, geographic);
    int compared = 0;
    for (int row = 0; row < dem.grid.rows(); row += 37) {
      for (int column = 0; column < dem.grid.columns(); column += 31) {
        if (std::isnan(dem.grid.height_m(column, row))) continue;
        auto [latitude_deg, longitude_deg] =
            std::array{p_W(dem, column, row).x, p_W(dem, column, row).y};
        OCTTransform(to_geographic, 1, &latitude_deg, &longitude_deg, nullptr);
        const double u = 1200 * (longitude_deg - 6);
        const double v = 1200 * (46 - latitude_deg);
        // Within half a cell of the edge there are too few samples to interpolate between.
        if (std::min({u, v, 1200 - u, 1200 - v}) < 0.5) continue;
        EXPECT_NEAR(dem.grid.height_m(column, row), 2 * u + v, 0.03 + 1e-3);
        ++compared;
      }
    }
    EXPECT_GT(compared, 500);
    OCTDestroyCoordinateTransformation(to_geographic);
    OSRDestroySpatialReference(utm);
    OSRDestroySpatialReference(geographic);
  }
}

TEST_F(DemIo, RejectsAGeographicDemWithACommandEquivalentToReprojecting) {
  if (std::system("gdalwarp --version > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "gdalwarp is not installed";
  const auto path = folder_ / "it's geographic.tif";
  Picture picture{.columns = 60,
                  .rows = 50,
                  .values = {},
                  .geotransform = std::array{-70.0, 0.001, 0.0, -33.0, 0.0, -0.001},
                  .crs = "EPSG:4326",
                  .type = GDT_Int16,
                  .nodata = -1,
                  .unit = "ft"};
  for (int i = 0; i < 3000; ++i)
    picture.values.push_back(i % 7 == 0 && i > 2000 ? -1 : i % 60 == 13 ? -32767 : i);
  picture.save_tiff(path);
  // gdalwarp accepts a single nodata value, so the comparison below uses the declared value only,
  // without DemOptions::nodata.
  const std::string message = error_of(path, {.nodata = -32767});
  EXPECT_THAT(message, HasSubstr("its CRS, WGS 84 (EPSG:4326), is geographic"));
  EXPECT_THAT(message, HasSubstr("set reproject_to to utm"));
  EXPECT_THAT(message, HasSubstr("\n  gdalwarp -t_srs EPSG:32719 -tr 100 100 -r bilinear"));
  const std::string line = error_of(path).substr(error_of(path).find("gdalwarp"));
  ASSERT_EQ(std::system((line + " > /dev/null").c_str()), 0) << line;
  const Dem by_line = load_dem(folder_ / "it's geographic_metric.tif");
  const Dem by_option = load_dem(path, {.reproject_to = "utm"});
  EXPECT_EQ(by_line.crs_name, by_option.crs_name);
  EXPECT_EQ(by_line.origin_w_m, by_option.origin_w_m);
  EXPECT_EQ(by_line.grid.origin_m(), by_option.grid.origin_m());
  EXPECT_EQ(by_line.grid.step_m(), by_option.grid.step_m());
  EXPECT_EQ(by_line.grid.hole_count(), by_option.grid.hole_count());
  EXPECT_THAT(heights(by_line),
              Pointwise(::testing::NanSensitiveFloatNear(1e-2f), heights(by_option)));
}

TEST_F(DemIo, ChoosesTheUtmZoneOfTheCentre) {
  const auto zone_at = [&](double longitude_deg, double latitude_deg) {
    Picture{.geotransform =
                std::array{longitude_deg - 0.0015, 0.001, 0.0, latitude_deg + 0.001, 0.0, -0.001},
            .crs = "EPSG:4326"}
        .save_tiff(tiff_);
    const std::string message = error_of(tiff_);
    const auto at = message.find("EPSG:3");
    return at == std::string::npos ? message : message.substr(at, 10);
  };
  EXPECT_EQ(zone_at(3, 45), "EPSG:32631");
  EXPECT_EQ(zone_at(5.9, 45), "EPSG:32631");
  EXPECT_EQ(zone_at(6.1, 45), "EPSG:32632");
  EXPECT_EQ(zone_at(-179.9, -10), "EPSG:32701");
  EXPECT_EQ(zone_at(179.9, 10), "EPSG:32660");
  EXPECT_EQ(zone_at(185, 10), "EPSG:32601");
  EXPECT_EQ(zone_at(20, 86), "EPSG:32661");
  EXPECT_EQ(zone_at(20, -86), "EPSG:32761");
}

TEST_F(DemIo, ProjectsOtherBodiesWithTheirOwnRadius) {
  Picture{.geotransform = std::array{10.0, 0.01, 0.0, 20.0, 0.0, -0.01},
          .crs = "+proj=longlat +R=1737400"}
      .save_tiff(tiff_);
  EXPECT_THAT(
      error_of(tiff_),
      HasSubstr("-t_srs '+proj=tmerc +lat_0=19.9900 +lon_0=10.0150 +R=1737400 +units=m +no_defs'"));
  const Dem dem = load_dem(tiff_, {.reproject_to = "utm"});
  EXPECT_THAT(dem.crs_wkt, HasSubstr("1737400"));
  // The origin of the projection is the raster's centre.
  EXPECT_NEAR(dem.origin_w_m.x, 0, 300);
  EXPECT_NEAR(dem.origin_w_m.y, 0, 300);
}

TEST_F(DemIo, DoesNotResampleADemAlreadyInTheTargetCrs) {
  Picture{}.save_tiff(tiff_);
  EXPECT_THAT(heights(load_dem(tiff_, {.reproject_to = utm_31})), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(DemIo, RejectsARotatedRasterWithTheCommandToRectifyIt) {
  Picture picture{.columns = 20,
                  .rows = 20,
                  .values = std::vector<double>(400, 7),
                  .geotransform = std::array{0.0, 8.0, 6.0, 0.0, 6.0, -8.0}};
  for (const char* crs : {"", utm_31}) {
    picture.crs = crs;
    picture.save_tiff(tiff_);
    const std::string message = error_of(tiff_);
    EXPECT_THAT(message, HasSubstr("its geotransform is rotated or sheared"));
    EXPECT_THAT(message, HasSubstr("gdalwarp -tr 10 10 -r bilinear"));
  }
  const Dem dem = load_dem(tiff_, {.reproject_to = utm_31});
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(10, -10));
  EXPECT_EQ(dem.grid.height_m_at(glm::dvec2(140, -20) - glm::dvec2(dem.origin_w_m)), 7);
  EXPECT_EQ(dem.grid.height_m_at(glm::dvec2(10, 90) - glm::dvec2(dem.origin_w_m)), std::nullopt);
}

TEST_F(DemIo, RejectsACrsInFeetWithTheCommandToReprojectIt) {
  Picture{.geotransform = std::array{1000000.0, 10.0, 0.0, 200000.0, 0.0, -10.0},
          .crs = "EPSG:2263"}
      .save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("has the unit US survey foot"));
  EXPECT_THAT(error_of(tiff_), HasSubstr("gdalwarp -t_srs EPSG:32618 -tr 3 3"));
}

TEST_F(DemIo, RejectsFilesThatAreNotRasters) {
  EXPECT_THAT(error_of(folder_ / "missing.tif"), HasSubstr("there is no such file"));
  write_text(folder_ / "notes.txt", "Heights will follow.\n");
  EXPECT_THAT(error_of(folder_ / "notes.txt"), HasSubstr("it cannot be opened as a raster"));
  EXPECT_THAT(error_of(folder_.path()), HasSubstr("it cannot be opened as a raster"));
  EXPECT_THROW(inspect_dem(folder_ / "missing.tif"), Error);
}

TEST_F(DemIo, RejectsRastersThatAreNotHeightGrids) {
  Picture{.columns = 1, .rows = 1, .values = {5}}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("it has 1 x 1 samples; a surface needs 2 x 2 or more"));
  Picture{.values = std::vector<double>(18, 1)}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("it has 3 bands"));
  EXPECT_THAT(error_of(tiff_), HasSubstr(fmt::format("gdal_translate -b 1 {} {}", tiff_.string(),
                                                     (folder_ / "dem_band1.tif").string())));
  Picture{.type = GDT_CFloat32}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("complex numbers (CFloat32)"));
  write_text(
      folder_ / "huge.vrt",
      R"(<VRTDataset rasterXSize="100000" rasterYSize="100000"><VRTRasterBand dataType="Float32" band="1"/></VRTDataset>)");
  EXPECT_THAT(error_of(folder_ / "huge.vrt"),
              HasSubstr("100000 x 100000 samples, more than the limit of 2147483648"));
}

TEST_F(DemIo, RejectsInvalidHeights) {
  Picture{.values = std::vector<double>(6, -9999), .nodata = -9999}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("none of its 3 x 2 samples has a height"));
  Picture{.values = {1, 2, 3, 4, std::numeric_limits<double>::infinity(), 6}}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("the height in column 1, row 1 is infinite"));
  Picture{.unit = "kelvin"}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_), HasSubstr("its heights are in 'kelvin'"));
}

TEST_F(DemIo, RejectsInvalidTargetsOfReprojection) {
  Picture{}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_, {.reproject_to = "nowhere"}),
              HasSubstr("reproject_to = 'nowhere' is not a CRS"));
  EXPECT_THAT(error_of(tiff_, {.reproject_to = "EPSG:4326"}), HasSubstr("is geographic"));
  Picture{.crs = ""}.save_tiff(tiff_);
  EXPECT_THAT(error_of(tiff_, {.reproject_to = "utm"}),
              HasSubstr("it has no CRS to reproject it from"));
}

TEST_F(DemIo, RejectsATruncatedFile) {
  Picture picture{.columns = 64,
                  .rows = 64,
                  .values = {},
                  .geotransform = std::array{499995.0, 30.0, 0.0, 4400025.0, 0.0, -30.0},
                  .type = GDT_Int16};
  for (int i = 0; i < 64 * 64; ++i) picture.values.push_back((i * 7919) % 4001);
  picture.save_tiff(tiff_);
  picture.save_as("AAIGrid", folder_ / "dem.asc");
  picture.save_as("USGSDEM", folder_ / "usgs.dem");
  picture.type = GDT_UInt16;
  picture.save_as("PNG", folder_ / "dem.png");
  for (const char* name : {"dem.tif", "dem.asc", "usgs.dem", "dem.png"}) {
    ASSERT_NO_THROW(load_dem(folder_ / name)) << name;
    const auto size = std::filesystem::file_size(folder_ / name);
    for (const double part : {0.95, 0.6, 0.2}) {
      std::filesystem::resize_file(folder_ / name,
                                   static_cast<std::uintmax_t>(part * static_cast<double>(size)));
      EXPECT_THAT(error_of(folder_ / name), Not(HasSubstr("no error"))) << name << " " << part;
    }
  }
  write_text(folder_ / "dem.vrt", R"(<VRTDataset rasterXSize="3" rasterYSize="2">
    <VRTRasterBand dataType="Float32" band="1"><SimpleSource>
      <SourceFilename relativeToVRT="1">gone.tif</SourceFilename><SourceBand>1</SourceBand>
    </SimpleSource></VRTRasterBand></VRTDataset>)");
  EXPECT_THAT(error_of(folder_ / "dem.vrt"), HasSubstr("gone.tif"));
}

TEST_F(DemIo, InspectionReportsSizeFormatTypeAndCrs) {
  Picture{.type = GDT_Int16}.save_tiff(tiff_);
  const DemInfo info = inspect_dem(tiff_);
  EXPECT_EQ(info.columns, 3);
  EXPECT_EQ(info.rows, 2);
  EXPECT_EQ(info.driver, "GTiff");
  EXPECT_EQ(info.sample_type, "Int16");
  EXPECT_EQ(info.crs_name, "WGS 84 / UTM zone 31N (EPSG:32631)");
}

TEST_F(DemIo, EquivalentCrsDefinitionsAreEqual) {
  constexpr const char* esri =
      "PROJCS[\"NAD_1983_UTM_Zone_15N\",GEOGCS[\"GCS_North_American_1983\","
      "DATUM[\"D_North_American_1983\",SPHEROID[\"GRS_1980\",6378137.0,298.257222101]],"
      "PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],"
      "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],"
      "PARAMETER[\"False_Northing\",0.0],PARAMETER[\"Central_Meridian\",-93.0],"
      "PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],"
      "UNIT[\"Meter\",1.0]]";
  EXPECT_TRUE(is_same_crs("EPSG:26915", "EPSG:26915"));
  EXPECT_TRUE(is_same_crs("ESRI::" + std::string(esri), "EPSG:26915"));
  EXPECT_TRUE(is_same_crs("EPSG:26915+5703", "EPSG:26915")) << "only one has a vertical datum";
  EXPECT_FALSE(is_same_crs("EPSG:26915+5703", "EPSG:26915+5773"));
  EXPECT_FALSE(is_same_crs("EPSG:26915", "EPSG:32615")) << "another datum";
  EXPECT_FALSE(is_same_crs("EPSG:26915", "EPSG:26916"));
  EXPECT_FALSE(is_same_crs("EPSG:26915", ""));
  EXPECT_FALSE(is_same_crs("nonsense", "nonsense"));
}

TEST(DemIoData, PrairieHasNoHolesAndOneMetrePosting) {
  const Dem dem = load_dem(testing::data_folder() / "terrain/prairie_1m.tif");
  EXPECT_EQ(dem.grid.columns(), 400);
  EXPECT_EQ(dem.grid.rows(), 400);
  EXPECT_EQ(dem.grid.hole_count(), 0u);
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(1, -1));
  EXPECT_EQ(dem.origin_w_m, glm::dvec3(429452, 5150685, 0));
  EXPECT_EQ(dem.crs_name, "NAD83 / UTM zone 15N (EPSG:26915)");
}

// Metres per degree at 36.589583 N by the series of the U.S. Defense Mapping Agency for WGS 84,
// accurate to 1 cm.
TEST(DemIoData, JacksboroHasAPostingOfThreeArcSecondsInMetres) {
  const Dem dem = load_dem(testing::data_folder() / "terrain/jacksboro.tif");
  EXPECT_EQ(dem.grid.columns(), 403);
  EXPECT_EQ(dem.grid.rows(), 344);
  EXPECT_EQ(dem.grid.min_height_m(), 236);
  EXPECT_EQ(dem.grid.max_height_m(), 1076);
  const double latitude = 36.58958333 * std::numbers::pi / 180;
  const double latitude_degree_m =
      111132.92 - 559.82 * std::cos(2 * latitude) + 1.175 * std::cos(4 * latitude);
  const double longitude_degree_m = 111412.84 * std::cos(latitude) - 93.5 * std::cos(3 * latitude) +
                                    0.118 * std::cos(5 * latitude);
  constexpr double degrees = 1 / 1200.0;
  EXPECT_NEAR(dem.grid.step_m().x / degrees, longitude_degree_m, 0.1);
  EXPECT_NEAR(dem.grid.step_m().y / degrees, -latitude_degree_m, 0.1);
  EXPECT_EQ(dem.origin_w_m, glm::dvec3(0));
}

// Oracle: the values that GDAL itself reads.
std::vector<float> gdal_values(const std::filesystem::path& path) {
  const Dataset dataset(GDALOpen(path.c_str(), GA_ReadOnly), &GDALClose);
  const int columns = GDALGetRasterXSize(dataset.get());
  const int rows = GDALGetRasterYSize(dataset.get());
  std::vector<float> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  EXPECT_EQ(GDALRasterIO(GDALGetRasterBand(dataset.get(), 1), GF_Read, 0, 0, columns, rows,
                         values.data(), columns, rows, GDT_Float32, 0, 0),
            CE_None);
  return values;
}

class SharedDem : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(dems_))
      GTEST_SKIP() << "there are no public DEMs in " << dems_ << "; set GROUNDRAY_SHARED_DATA";
  }

  static void expect_values(const Dem& dem, const std::filesystem::path& path, float nodata) {
    std::vector<float> expected = gdal_values(path);
    std::ranges::replace(expected, nodata, hole);
    EXPECT_EQ(dem.grid.hole_count(), static_cast<std::size_t>(std::ranges::count_if(
                                         expected, [](float z) { return std::isnan(z); })));
    EXPECT_TRUE(std::ranges::equal(dem.grid.heights_m(), expected, [](float a, float b) {
      return a == b || (std::isnan(a) && std::isnan(b));
    }));
  }

  std::filesystem::path dems_ = shared_data_folder() / "dem";
};

TEST_F(SharedDem, BigTujunga) {
  const auto path = dems_ / "bigtujunga_30m/bigtujunga.tif";
  const Dem dem = load_dem(path);
  EXPECT_EQ(dem.crs_name, "WGS 84 / UTM zone 11N (EPSG:32611)");
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(30, -30));
  EXPECT_EQ(dem.origin_w_m, glm::dvec3(394269, 3798273, 0));
  expect_values(dem, path, 32767);
}

TEST_F(SharedDem, LidarGroundWithDeclaredHoles) {
  const auto path = dems_ / "lidar_dsm_dtm_2m/dtm.tif";
  const Dem dem = load_dem(path);
  EXPECT_EQ(dem.grid.step_m(), glm::dvec2(2, -2));
  EXPECT_EQ(p_W(dem, 0, 0), glm::dvec2(321499, 4298017));
  EXPECT_GT(dem.grid.hole_count(), 0u);
  expect_values(dem, path, -9999);
}

// The limits are the file's own TIFFTAG_MINSAMPLEVALUE and TIFFTAG_MAXSAMPLEVALUE.
TEST_F(SharedDem, WarpExcludesUndeclaredNodataOfCraterLake) {
  const auto path = dems_ / "crater_lake_dem_and_image/craterlake-elev-16bit-30m.tif";
  EXPECT_THAT(error_of(path, {.nodata = -32767}), HasSubstr("gdalwarp -t_srs EPSG:32610 "));
  EXPECT_THAT(error_of(path, {.nodata = -32767}), HasSubstr("-srcnodata -32767 "));
  const Dem dem = load_dem(path, {.nodata = -32767, .reproject_to = "utm"});
  EXPECT_EQ(dem.crs_name, "WGS 84 / UTM zone 10N (EPSG:32610)");
  EXPECT_NEAR(dem.grid.min_height_m(), 1289, 1);
  EXPECT_NEAR(dem.grid.max_height_m(), 1880, 1);
}

TEST_F(SharedDem, EdgeCasesOfGazebo) {
  const auto folder = dems_ / "gz_common_edge_cases";
  const Dem moon = load_dem(folder / "dem_moon.tif");
  EXPECT_EQ(moon.crs_name, "Moon2000_npole");
  EXPECT_EQ(moon.origin_w_m, glm::dvec3(-53710, -51090, 0));
  expect_values(moon, folder / "dem_moon.tif", hole);
  expect_values(load_dem(folder / "dem_nodata.dem"), folder / "dem_nodata.dem", -32767);
  const Environment permission("GROUNDRAY_RASTER_DRIVERS", "netCDF");
  const Dem holed = load_dem(folder / "dem_nodata_nan.nc");
  EXPECT_GT(holed.grid.hole_count(), 0u);
  expect_values(holed, folder / "dem_nodata_nan.nc", hole);
  for (const char* name : {"dem_landscape.tif", "dem_portrait.tif", "dem_squared.tif"}) {
    EXPECT_THAT(error_of(folder / name), HasSubstr("gdalwarp -t_srs EPSG:32610 "));
  }
}

TEST_F(SharedDem, ProposesALunarProjection) {
  EXPECT_THAT(error_of(dems_ / "moon_gld100_8193/moon_gld100_8193.tif"),
              HasSubstr("-t_srs '+proj=tmerc +lat_0=30.0020 +lon_0=16.0020 +R=1737400 "));
}

TEST_F(SharedDem, LoadsAnSrtmTileFromItsArchive) {
  const std::string path =
      "/vsizip/" + (dems_ / "srtm3_sierra_nevada/N37W004.hgt.zip/N37W004.hgt").string();
  EXPECT_THAT(error_of(path), HasSubstr(path + " N37W004_metric.tif"));
  const Dem dem = load_dem(path, {.reproject_to = "utm"});
  EXPECT_EQ(dem.crs_name, "WGS 84 / UTM zone 30N (EPSG:32630)");
  const std::vector<float> source = gdal_values(path);
  EXPECT_GE(dem.grid.min_height_m(), std::ranges::min(source));
  EXPECT_LE(dem.grid.max_height_m(), std::ranges::max(source));
}

}  // namespace
}  // namespace groundray::dem_io_test
