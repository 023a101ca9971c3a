#include "terrain/dem/drape_io.h"

#include <cpl_error.h>
#include <gdal.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/random.h"
#include "terrain/dem/dem_io.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"

namespace groundray::drape_io_test {
namespace {

using ::testing::AllOf;
using testing::GeoTiff;
using ::testing::HasSubstr;
using testing::shared_data_folder;
using ::testing::StartsWith;
using testing::TemporaryFolder;

using Path = std::filesystem::path;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::string error_of(const auto& load) {
  ::testing::internal::CaptureStderr();
  std::string message = "no error";
  try {
    load();
  } catch (const Error& error) {
    message = error.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  return message;
}

// Linear light of an sRGB byte (IEC 61966-2-1).
double light_of(double byte) {
  const double c = byte / 255;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

int byte_of(float light) {
  const double c =
      light <= 0.0031308f ? 12.92 * light : 1.055 * std::pow(double{light}, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * c));
}

// Returns the stored value of a texel's channel.
int stored(const Texture& image, int column, int row, int channel) {
  const glm::vec4 texel = image.texel(0, column, row);
  return channel == 3 ? static_cast<int>(std::lround(255 * texel.w)) : byte_of(texel[channel]);
}

// Random bytes, band by band.
std::vector<double> noise(glm::ivec2 size, int bands) {
  std::vector<double> values;
  for (int i = 0; i < size.x * size.y * bands; ++i) {
    const auto pulse = static_cast<std::uint32_t>(i);
    values.push_back(std::floor(256 * random_uniform({.seed = {5}, .pulse = pulse}).x));
  }
  return values;
}

GeoTiff photo(glm::ivec2 size, int bands) {
  return {.size = size, .values = noise(size, bands), .type = GDT_Byte};
}

// Opens a file for changes that GeoTiff does not support.
void change(const Path& path, const std::function<void(GDALDatasetH)>& work) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  GDALDatasetH file = GDALOpen(path.c_str(), GA_Update);
  work(file);
  GDALClose(file);
}

std::string wkt_of(const char* name) {
  OGRSpatialReference crs;
  crs.SetFromUserInput(name);
  char* text = nullptr;
  crs.exportToWkt(&text);
  std::string wkt = text;
  CPLFree(text);
  return wkt;
}

// Oracle: the file's own pixels, for explicit interpolation at positions in another CRS.
struct Original {
  glm::ivec2 size;
  std::vector<double> values;
  std::array<double, 6> geotransform;
  std::unique_ptr<OGRCoordinateTransformation> from_w;  // null: the file is in W

  Original(const GeoTiff& file, const std::string& crs_wkt)
      : size(file.size), values(file.values), geotransform(file.geotransform) {
    if (crs_wkt.empty() || crs_wkt == file.crs) return;
    OGRSpatialReference own, world;
    own.SetFromUserInput(file.crs.c_str());
    world.SetFromUserInput(crs_wkt.c_str());
    own.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    world.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    from_w.reset(OGRCreateCoordinateTransformation(&world, &own));
  }

  // Returns the column and row, integers at pixel centres.
  glm::dvec2 pixel_at(glm::dvec2 p_W) const {
    if (from_w) from_w->Transform(1, &p_W.x, &p_W.y);
    const auto& gt = geotransform;
    const double x = p_W.x - gt[0], y = p_W.y - gt[3], area = gt[1] * gt[5] - gt[2] * gt[4];
    return glm::dvec2(gt[5] * x - gt[2] * y, gt[1] * y - gt[4] * x) / area - 0.5;
  }
  double value(glm::ivec2 at, int band) const {
    const std::ptrdiff_t row = std::ptrdiff_t{band} * size.y + at.y;
    return values[static_cast<std::size_t>(row * size.x + at.x)];
  }
  double alpha(glm::ivec2 at) const {
    return std::ssize(values) == std::ptrdiff_t{4} * size.x * size.y ? value(at, 3) : 255;
  }
  // Signed distance to the rectangle through the centres of the outermost pixels, in pixels;
  // negative outside.
  double depth(glm::dvec2 pixel) const {
    return std::min({pixel.x, pixel.y, size.x - 1 - pixel.x, size.y - 1 - pixel.y});
  }
};

// Checks a warped drape. Each texel well inside the file is the bilinear interpolation of the
// file's pixels, to one rounding of the result and 0.01 pixels along each axis (gdalwarp -et 0.01);
// over this distance it changes by at most the range of the four pixels. Each texel well outside,
// or among transparent pixels, has no data.
// @return the number of texels without data.
int expect_warped(const Drape& drape, const Original& file, int bands, glm::dvec2 origin_w_m) {
  const glm::ivec2 size = drape.image.size();
  int inside = 0, bare = 0;
  for (int i = 0; i < size.x * size.y; ++i) {
    const glm::ivec2 at(i % size.x, i / size.x);
    const glm::dvec2 uv((at.x + 0.5) / size.x, 1 - (at.y + 0.5) / size.y);
    const glm::dvec2 pixel = file.pixel_at(origin_w_m + drape.corner_m + uv * drape.size_m);
    const bool is_outside = file.depth(pixel) < -0.52;
    if (!is_outside && file.depth(pixel) < 0.02) continue;
    const glm::ivec2 low(pixel);
    const std::array corners{low, low + glm::ivec2(1, 0), low + glm::ivec2(0, 1), low + 1};
    const auto is_bare = [&](glm::ivec2 corner) { return file.alpha(corner) == 0; };
    const bool has_none = is_outside || std::ranges::all_of(corners, is_bare);
    if (!has_none && std::ranges::any_of(corners, is_bare)) continue;
    ++(has_none ? bare : inside);
    EXPECT_EQ(stored(drape.image, at.x, at.y, 3), has_none ? 0 : 255) << at.x << " " << at.y;
    for (int band = 0; band < bands && !has_none; ++band) {
      std::array<double, 4> four{};
      std::ranges::transform(corners, four.begin(),
                             [&](glm::ivec2 corner) { return file.value(corner, band); });
      const glm::dvec2 t = pixel - glm::dvec2(low);
      const double expected = (1 - t.y) * ((1 - t.x) * four[0] + t.x * four[1]) +
                              t.y * ((1 - t.x) * four[2] + t.x * four[3]);
      const auto [least, most] = std::ranges::minmax(four);
      const double tolerance = 0.501 + 0.02 * (most - least);
      EXPECT_NEAR(stored(drape.image, at.x, at.y, band), expected, tolerance)
          << at.x << " " << at.y;
      testing::record_margin("texels",
                             (stored(drape.image, at.x, at.y, band) - expected) / tolerance, 1);
    }
  }
  EXPECT_GT(inside, 0.6 * file.size.x * file.size.y);
  return bare;
}

class DrapeIo : public ::testing::Test {
 protected:
  Path saved(const GeoTiff& file) const {
    file.save(path_);
    return path_;
  }
  std::string photo_error(const OrthophotoOptions& options = {}) const {
    return error_of([&] { load_orthophoto(path_, options); });
  }
  std::string mask_error(const MaskOptions& options = {}) const {
    return error_of([&] { load_mask(path_, options); });
  }
  TemporaryFolder folder_;
  Path path_ = folder_ / "ground.tif";
};

TEST_F(DrapeIo, DrapeCoversItsExtentIncludingTheBoundary) {
  const Drape drape{Texture(ImageF(2, 2, 1), Wrap::Clamp), {10, -4}, {6, 3}};
  EXPECT_EQ(drape.uv_at({10, -4}), glm::dvec2(0));
  EXPECT_EQ(drape.uv_at({16, -1}), glm::dvec2(1));
  EXPECT_EQ(drape.uv_at({13, -2.5}), glm::dvec2(0.5));
  for (const glm::dvec2 p : {glm::dvec2(10, -4), {16, -1}, {16, -4}, {12, -2}}) {
    EXPECT_TRUE(drape.covers(p));
  }
  for (const glm::dvec2 p :
       {glm::dvec2(9.999, -2), {16.001, -2}, {12, -4.001}, {12, -0.999}, {nan, -2}, {12, nan}}) {
    EXPECT_FALSE(drape.covers(p));
  }
}

// The geotransform also applies to rasters whose rows run north or whose columns run west.
TEST_F(DrapeIo, PhotoPixelsFollowTheGeotransform) {
  const glm::dvec3 origin_w_m(500001, 5149990, 0);
  for (const glm::dvec2 step : {glm::dvec2(2, -4), {2, 4}, {-2, -4}, {-2, 4}}) {
    for (const int bands : {1, 3}) {
      GeoTiff file = photo({5, 4}, bands);
      file.geotransform = {500000, step.x, 0, 5150000, 0, step.y};
      const Drape drape = load_orthophoto(saved(file), {.origin_w_m = origin_w_m});
      EXPECT_FALSE(drape.image.has_alpha());
      const glm::dvec2 corner(500000 - 500001, 5150000 - 5149990);
      EXPECT_EQ(drape.corner_m, glm::min(corner, corner + step * glm::dvec2(5, 4)));
      EXPECT_EQ(drape.size_m, glm::dvec2(10, 16));
      for (int i = 0; i < 20; ++i) {
        const glm::dvec2 p = corner + (glm::dvec2(i % 5, i / 5) + 0.5) * step;
        ASSERT_TRUE(drape.covers(p));
        const glm::vec3 color = drape.image.color(drape.uv_at(p));
        for (int c = 0; c < 3; ++c) {
          const auto plane = static_cast<std::size_t>(c % bands);
          const double byte = file.values[static_cast<std::size_t>(i) + 20 * plane];
          // Interpolation weights are 0 and 1 except for rounding.
          EXPECT_NEAR(color[c], light_of(byte), 1e-6);
        }
      }
    }
  }
}

TEST_F(DrapeIo, BandsOfAPhotoAreIdentifiedByTheirColor) {
  saved(photo({3, 2}, 3));
  change(path_, [](GDALDatasetH file) {
    for (int i = 1; i <= 3; ++i) {
      const auto color = static_cast<GDALColorInterp>(GCI_BlueBand + 1 - i);
      GDALSetRasterColorInterpretation(GDALGetRasterBand(file, i), color);
    }
  });
  const Texture image = load_orthophoto(path_, {}).image;
  const std::vector<double> values = noise({3, 2}, 3);
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(stored(image, 1, 0, c), values[static_cast<std::size_t>(1 + 6 * (2 - c))]);
  }
}

TEST_F(DrapeIo, AlphaOfAPhotoIsKept) {
  GeoTiff file = photo({4, 3}, 4);  // GDAL treats the last of four byte bands as alpha
  file.values[36] = 0;
  const Texture image = load_orthophoto(saved(file), {}).image;
  ASSERT_TRUE(image.has_alpha());
  for (int i = 1; i < 12; ++i) {
    for (int c = 0; c < 4; ++c) {
      EXPECT_EQ(stored(image, i % 4, i / 4, c), file.values[static_cast<std::size_t>(i + 12 * c)]);
    }
  }
  EXPECT_EQ(stored(image, 0, 0, 3), 0);
  std::fill(file.values.begin() + 36, file.values.end(), 255);
  EXPECT_FALSE(load_orthophoto(saved(file), {}).image.has_alpha());
}

TEST_F(DrapeIo, PixelsWithNodataInAllBandsAreTransparent) {
  GeoTiff file = photo({3, 2}, 3);
  file.nodata = 7;
  file.values = {7, 1, 2, 7, 3, 4,  //
                 7, 1, 2, 9, 3, 4,  //
                 7, 1, 7, 9, 3, 4};
  const Texture image = load_orthophoto(saved(file), {}).image;
  EXPECT_EQ(stored(image, 0, 0, 3), 0);
  for (int i = 1; i < 6; ++i) {
    EXPECT_EQ(stored(image, i % 3, i / 3, 0), file.values[static_cast<std::size_t>(i)]);
    EXPECT_EQ(stored(image, i % 3, i / 3, 3), 255);
  }
}

TEST_F(DrapeIo, MaskOfTheFileMakesPixelsTransparent) {
  for (const int bands : {1, 3}) {
    GeoTiff file = photo({4, 5}, bands);
    file.has_mask = true;
    const Texture image = load_orthophoto(saved(file), {}).image;
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(stored(image, i % 4, i / 4, 3), i % 3 == 0 ? 0 : 255);
    }
  }
}

TEST_F(DrapeIo, PaletteIsApplied) {
  const std::array<std::array<short, 4>, 3> colors{{{10, 20, 30, 255}, {40, 5, 6, 255}, {}}};
  GeoTiff file{.size = {2, 2}, .values = {1, 0, 2, 1}, .type = GDT_Byte};
  saved(file);
  change(path_, [&](GDALDatasetH dataset) {
    GDALColorTableH table = GDALCreateColorTable(GPI_RGB);
    for (int i = 0; i < 3; ++i) {
      const auto& c = colors[static_cast<std::size_t>(i)];
      const GDALColorEntry entry{c[0], c[1], c[2], c[3]};
      GDALSetColorEntry(table, i, &entry);
    }
    GDALSetRasterColorTable(GDALGetRasterBand(dataset, 1), table);
    GDALDestroyColorTable(table);
  });
  const Texture image = load_orthophoto(path_, {}).image;
  for (const int i : {0, 1, 3}) {
    for (int c = 0; c < 4; ++c) {
      EXPECT_EQ(stored(image, i % 2, i / 2, c),
                colors[static_cast<std::size_t>(file.values[static_cast<std::size_t>(i)])]
                      [static_cast<std::size_t>(c)]);
    }
  }
}

// A photo of one colour keeps that colour in every texel, regardless of how many pixels are hidden.
TEST_F(DrapeIo, TransparentPixelsDoNotDarkenTheirNeighbours) {
  const glm::ivec2 size(37, 23);  // 851 pixels
  GeoTiff file{.size = size, .values = {}, .type = GDT_Byte};
  const std::array<double, 3> color{200, 100, 50};
  for (const double c : color) file.values.insert(file.values.end(), 851, c);
  for (int i = 0; i < 851; ++i) {
    const bool is_shown = i % 37 > 20 && i % 5 < 2;
    file.values.push_back(is_shown ? 255 : 0);
    for (std::size_t c = 0; c < 3 && !is_shown; ++c) {
      file.values[static_cast<std::size_t>(i) + c * 851] = 0;
    }
  }
  const Texture image = load_orthophoto(saved(file), {}).image;
  for (int i = 0; i < 851; ++i) {
    const auto index = static_cast<std::size_t>(i) + std::size_t{3} * 851;
    EXPECT_EQ(stored(image, i % 37, i / 37, 3), file.values[index]);
    for (int c = 0; c < 3; ++c) {
      ASSERT_EQ(stored(image, i % 37, i / 37, c), color[static_cast<std::size_t>(c)]);
    }
  }
}

TEST_F(DrapeIo, PhotoInDegreesIsWarpedToTheGroundsCrs) {
  const glm::dvec3 origin_w_m(500'000, 5'149'000, 0);
  GeoTiff file = photo({60, 80}, 3);
  file.geotransform = {8.999, 1.4e-5, 0, 46.501, 0, -1e-5};
  file.crs = "EPSG:4326";
  for (const char* world : {"EPSG:32632", "EPSG:32631"}) {
    const std::string crs_wkt = wkt_of(world);
    const Drape drape =
        load_orthophoto(saved(file), {.crs_wkt = crs_wkt, .origin_w_m = origin_w_m});
    const int bare = expect_warped(drape, Original(file, crs_wkt), 3, origin_w_m);
    EXPECT_EQ(bare > 0, crs_wkt == wkt_of("EPSG:32631"));  // north is rotated there
  }
}

TEST_F(DrapeIo, RotatedPhotoIsWarped) {
  GeoTiff file = photo({50, 70}, 3);
  const double c = 0.5 * std::cos(0.4), s = 0.5 * std::sin(0.4);
  file.geotransform = {500000, c, s, 5150000, s, -c};
  for (const char* crs : {"EPSG:32631", ""}) {
    file.crs = crs;
    const Drape drape = load_orthophoto(saved(file), {.crs_wkt = wkt_of("EPSG:32631")});
    EXPECT_GT(expect_warped(drape, Original(file, ""), 3, {}), 1000);
  }
}

TEST_F(DrapeIo, GreyPhotoIsWarpedLikeAColorPhoto) {
  GeoTiff file = photo({40, 40}, 1);
  file.crs = "EPSG:32632";
  const std::string crs_wkt = wkt_of("EPSG:32631");
  const Drape drape = load_orthophoto(saved(file), {.crs_wkt = crs_wkt});
  EXPECT_GT(expect_warped(drape, Original(file, crs_wkt), 1, {}), 0);
}

// A vertical part of the ground's CRS does not apply to the photo.
TEST_F(DrapeIo, VerticalCrsOfTheGroundIsIgnored) {
  GeoTiff file = photo({4, 3}, 3);
  file.crs = "EPSG:26915";
  const Drape drape = load_orthophoto(saved(file), {.crs_wkt = wkt_of("EPSG:26915+5703")});
  EXPECT_FALSE(drape.image.has_alpha());
  EXPECT_EQ(drape.corner_m, glm::dvec2(500000, 5150000 - 6));
  file.values = std::vector<double>(12, 1);
  EXPECT_EQ(load_mask(saved(file), {.crs_wkt = wkt_of("EPSG:26915+5703")}).size_m,
            glm::dvec2(8, 6));
}

// Crater Lake: a photo in degrees is warped to the UTM zone of its DEM.
TEST_F(DrapeIo, PublicPhotoIsAlignedWithItsDem) {
  const Path lake = shared_data_folder() / "dem/crater_lake_dem_and_image";
  const Path picture = lake / "craterlake-imagery-30m.tif";
  if (!std::filesystem::exists(picture)) {
    GTEST_SKIP() << "there is no public photo in " << lake << "; set GROUNDRAY_SHARED_DATA";
  }
  GDALAllRegister();
  GeoTiff file{.size = {429, 279}, .values = std::vector<double>(std::size_t{429} * 279 * 4)};
  GDALDatasetH dataset = GDALOpen(picture.c_str(), GA_ReadOnly);
  GDALGetGeoTransform(dataset, file.geotransform.data());
  ASSERT_EQ(GDALDatasetRasterIO(dataset, GF_Read, 0, 0, 429, 279, file.values.data(), 429, 279,
                                GDT_Float64, 4, nullptr, 0, 0, 0),
            CE_None);
  GDALClose(dataset);
  file.crs = "EPSG:4326";
  const Dem dem = load_dem(lake / "craterlake-elev-16bit-30m.tif", {.reproject_to = "utm"});
  const Drape drape =
      load_orthophoto(picture, {.crs_wkt = dem.crs_wkt, .origin_w_m = dem.origin_w_m});
  EXPECT_GT(expect_warped(drape, Original(file, dem.crs_wkt), 3, dem.origin_w_m), 10'000);
  EXPECT_TRUE(drape.covers({0, 0}));
}

TEST_F(DrapeIo, MaskValuesAreFractionsOfFull) {
  GeoTiff file{.size = {3, 2}, .values = {0, 51, 102, 153, 204, 255}, .type = GDT_Byte};
  const Drape drape = load_mask(saved(file), {.full = 255, .origin_w_m = {500000, 5150000, 0}});
  EXPECT_FALSE(drape.image.has_alpha());
  EXPECT_EQ(drape.corner_m, glm::dvec2(0, -4));
  EXPECT_EQ(drape.size_m, glm::dvec2(6, 4));
  for (int i = 0; i < 6; ++i) {
    const glm::vec4 texel = drape.image.texel(0, i % 3, i / 3);
    EXPECT_EQ(texel, glm::vec4(glm::vec3(static_cast<float>(i / 5.0)), 1));
  }
  EXPECT_EQ(drape.image.texel(0, 2, 1).x, 1);
  file.geotransform = {500006, -2, 0, 5149996, 0, 2};
  std::ranges::reverse(file.values);
  const Drape turned = load_mask(saved(file), {.full = 255, .origin_w_m = {500000, 5150000, 0}});
  EXPECT_EQ(turned.corner_m, drape.corner_m);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(turned.image.texel(0, i % 3, i / 3), drape.image.texel(0, i % 3, i / 3));
  }
}

TEST_F(DrapeIo, MaskIsZeroAtNodata) {
  const float infinity = std::numeric_limits<float>::infinity();
  GeoTiff file{.size = {3, 2}, .values = {1, 0.5, nan, 3, 0.25, 9}};
  file.nodata = 9;
  const Texture image = load_mask(saved(file), {.nodata = 3}).image;
  const std::array expected{1.0f, 0.5f, 0.0f, 0.0f, 0.25f, 0.0f};
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(image.texel(0, i % 3, i / 3).x, expected[static_cast<std::size_t>(i)]);
  }
  file.values[1] = infinity;
  saved(file);
  EXPECT_THAT(mask_error(), HasSubstr("column 1, row 0 is infinite"));
}

// 1 / 255 rounded to six digits is too large by a relative 3.6e-7.
TEST_F(DrapeIo, ToleratesRoundingOfAMasksScale) {
  GeoTiff file{.size = {2, 2}, .values = {0, 255, 255, 0}, .type = GDT_Byte, .scale = 0.00392157};
  EXPECT_EQ(load_mask(saved(file), {}).image.texel(0, 1, 0).x, 1);
  file.scale = 0.003922;
  saved(file);
  EXPECT_THAT(mask_error(), HasSubstr("mask_full"));
}

// Expected positions from GDAL: 9 E, 46.5 N, the edge between the two halves, is at (500000,
// 5149603.4) in zone 32 and at (960347.1, 5167118.9) in zone 31, where north is rotated by 4.4
// degrees.
TEST_F(DrapeIo, MaskInAnotherCrsIsWarpedToTheGroundsCrs) {
  GeoTiff file{.size = {200, 200}, .values = {}, .crs = "EPSG:32632"};
  file.geotransform = {499000, 10, 0, 5151000, 0, -10};
  for (int i = 0; i < 40'000; ++i) file.values.push_back(i % 200 < 100 ? 1 : 0);
  const Drape mask = load_mask(saved(file), {.crs_wkt = wkt_of("EPSG:32631")});
  EXPECT_EQ(mask.image.color(mask.uv_at({960347.1 - 25, 5167118.9})).x, 1);
  EXPECT_EQ(mask.image.color(mask.uv_at({960347.1 + 25, 5167118.9})).x, 0);
  // The middle of the edge: a ramp of one or two pixels changes by at most 0.1 within 0.1 pixels.
  EXPECT_NEAR(mask.image.color(mask.uv_at({960347.1, 5167118.9})).x, 0.5, 0.1);
  EXPECT_EQ(mask.image.texel(0, 0, 0).x, 0);  // beyond the raster
  file.values[0] = 4;
  saved(file);
  EXPECT_THAT(mask_error({.crs_wkt = wkt_of("EPSG:32631")}), HasSubstr("of the warped raster is"));
}

TEST_F(DrapeIo, ReportsMaskValuesOutOfRange) {
  GeoTiff file{.size = {3, 2}, .values = {0, 1, 0, 0, 200, 255}, .type = GDT_Byte};
  saved(file);
  EXPECT_THAT(mask_error(),
              AllOf(StartsWith(path_.string() + ": "),
                    HasSubstr("column 1, row 1 is 200; it must be from 0 to mask_full = 1: set "
                              "mask_full: 255 if 255 means full cover")));
  EXPECT_THAT(mask_error({.full = 0}), HasSubstr("mask_full = 0 must be positive"));
  EXPECT_THAT(mask_error({.full = nan}), HasSubstr("mask_full = nan must be positive"));
  file = {.size = {2, 2}, .values = {0, 1, -9999, 0}};
  saved(file);
  EXPECT_THAT(mask_error(),
              AllOf(HasSubstr("column 0, row 1 is -9999"), HasSubstr("mask_nodata: -9999 if")));
}

TEST_F(DrapeIo, ReportsUnreadableFiles) {
  EXPECT_THAT(photo_error(), AllOf(StartsWith(path_.string() + ": "), HasSubstr("no such file")));
  EXPECT_THAT(mask_error(), AllOf(StartsWith(path_.string() + ": "), HasSubstr("no such file")));
  std::ofstream(path_) << "A photo will follow.\n";
  EXPECT_THAT(photo_error(), HasSubstr("cannot be opened as a raster"));
  EXPECT_THAT(mask_error(), HasSubstr("cannot be opened as a raster"));
  GeoTiff file = photo({300, 300}, 3);
  saved(file);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) / 2);
  EXPECT_THAT(photo_error(), AllOf(HasSubstr("cannot all be read"), HasSubstr("cut short?")));
  file.values.resize(90'000);
  saved(file);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) / 2);
  EXPECT_THAT(mask_error({.full = 255}), HasSubstr("was the file cut short?"));
  file = photo({3, 2}, 3);
  file.nodata = 0;
  std::ranges::fill(file.values, 0);
  saved(file);
  EXPECT_THAT(photo_error(), HasSubstr("none of its 3 x 2 pixels has data"));
}

TEST_F(DrapeIo, RejectsOtherBandsAndTypesAndPrintsTheCommandToConvertThem) {
  GeoTiff file = photo({3, 2}, 3);
  file.type = GDT_UInt16;
  saved(file);
  EXPECT_THAT(photo_error(),
              AllOf(HasSubstr("its band 1 is of type UInt16"),
                    HasSubstr("gdal_translate -ot Byte -scale 0 65535 0 255 " + path_.string()),
                    HasSubstr("ground_bytes.tif")));
  file.type = GDT_Float32;
  saved(file);
  EXPECT_THAT(photo_error(), HasSubstr("gdal_translate -ot Byte -scale " + path_.string()));
  file = photo({3, 2}, 4);
  file.options = {"PHOTOMETRIC=RGB", "ALPHA=UNSPECIFIED"};
  saved(file);
  EXPECT_THAT(photo_error(), AllOf(HasSubstr("it has 4 bands (Red, Green, Blue, Undefined)"),
                                   HasSubstr("gdal_translate -b 1 -b 2 -b 3 ")));
  saved(photo({3, 2}, 2));
  EXPECT_THAT(photo_error(), AllOf(HasSubstr("it has 2 bands"), HasSubstr("_translate -b 1 ")));
}

TEST_F(DrapeIo, RejectsPhotosThatCannotBeGeoreferenced) {
  GeoTiff file = photo({3, 2}, 3);
  file.crs = "EPSG:4326";
  file.geotransform = {9, 0.01, 0, 46, 0, -0.01};
  saved(file);
  EXPECT_THAT(photo_error(), AllOf(HasSubstr("is geographic"), HasSubstr("the ground has no CRS"),
                                   HasSubstr("gdalwarp -t_srs EPSG:32632 -r bilinear -dstalpha")));
  EXPECT_THAT(mask_error({.full = 255}), HasSubstr("bands"));
  file.crs = R"(LOCAL_CS["site grid",UNIT["metre",1]])";
  saved(file);
  EXPECT_EQ(photo_error({.crs_wkt = wkt_of(file.crs.c_str())}), "no error");
  // The datum of a local CRS has no name in some versions of PROJ, but in DEMs always.
  const Path dem = path_.parent_path() / "dem.tif";
  GeoTiff{.size = {4, 4}, .values = noise({4, 4}, 1), .crs = file.crs}.save(dem);
  const std::string named = load_dem(dem).crs_wkt;
  EXPECT_THAT(named, HasSubstr("EDATUM[\"Unknown engineering datum\""));
  EXPECT_EQ(photo_error({.crs_wkt = named}), "no error");
  std::string nameless = named;
  nameless.erase(nameless.find("Unknown engineering datum"), 25);
  EXPECT_TRUE(is_same_crs(named, nameless));
  EXPECT_THAT(photo_error({.crs_wkt = wkt_of("EPSG:32632")}),
              AllOf(HasSubstr("site grid"), HasSubstr("WGS 84 / UTM zone 32N (EPSG:32632)")));
  EXPECT_THAT(photo_error({.crs_wkt = "EPSG:0"}), HasSubstr("'EPSG:0', is not known to GDAL"));
  file.crs = "";
  file.geotransform = {0, 1, 0, 0, 0, 1};  // GDAL's marker for no geotransform
  saved(file);
  change(path_, [](GDALDatasetH dataset) {
    char id[] = "1", info[] = "";
    GDAL_GCP point{id, info, 0, 0, 500000, 5000000, 0};
    GDALSetGCPs(dataset, 1, &point, wkt_of("EPSG:32632").c_str());
  });
  EXPECT_THAT(photo_error(), AllOf(HasSubstr("ground control points"),
                                   HasSubstr("gdalwarp -r bilinear -dstalpha")));
}

// Returns the two numbers that follow -outsize.
glm::dvec2 outsize_of(const std::string& message) {
  const std::size_t at = message.find("-outsize ");
  if (at == std::string::npos) return glm::dvec2(nan);
  std::size_t read = 0;
  const double columns = std::stod(message.substr(at + 9), &read);
  return {columns, std::stod(message.substr(at + 9 + read))};
}

// The rasters are VRT files without sources, so that no file is large.
TEST_F(DrapeIo, RejectsTooManyPixelsAndReportsTheSizeThatFits) {
  const auto most = static_cast<double>(most_image_pixels);
  const Path vrt = folder_ / "huge.vrt";
  const auto write = [&](glm::ivec2 size, const char* transform) {
    std::ofstream(vrt) << fmt::format(
        R"(<VRTDataset rasterXSize="{}" rasterYSize="{}"><GeoTransform>{}</GeoTransform>
           <VRTRasterBand dataType="Byte" band="1"/></VRTDataset>)",
        size.x, size.y, transform);
  };
  for (const glm::ivec2 size : {glm::ivec2(20'000, 16'384), {300'000, 1000}, {3, 100'000'000}}) {
    write(size, "0, 1, 0, 0, 0, -1");
    for (const bool is_photo : {true, false}) {
      const std::string message = error_of([&] {
        if (is_photo) {
          load_orthophoto(vrt, {});
        } else {
          load_mask(vrt, {});
        }
      });
      EXPECT_THAT(message,
                  HasSubstr(fmt::format("it has {} x {} pixels, more than the limit of 268435456",
                                        size.x, size.y)));
      EXPECT_THAT(message, HasSubstr("gdal_translate -r average -outsize "));
      const glm::dvec2 fits = outsize_of(message);
      EXPECT_LE(fits.x * fits.y, most);
      EXPECT_GT(fits.x * fits.y, (size.x > 3 ? 0.99 : 0.6) * most);  // 3 columns become 2
    }
  }
  // A diagonal strip of 30000 x 10 pixels needs a square of about 21220 x 21220.
  write({30'000, 10}, "0, 0.7, 0.7, 0, 0.7, -0.7");
  const std::string message = error_of([&] { load_orthophoto(vrt, {}); });
  EXPECT_THAT(message, HasSubstr("pixels in the ground's CRS, more than"));
  const glm::dvec2 fits = outsize_of(message);
  const double side = fits.x * std::sqrt(0.5);
  EXPECT_LE(side * side, most);
  EXPECT_GT(side * side, 0.7 * most);
}

}  // namespace
}  // namespace groundray::drape_io_test
