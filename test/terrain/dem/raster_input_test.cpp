#include "terrain/dem/raster_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "terrain/dem/band_file.h"
#include "terrain/dem/dem_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::raster_input_test {
namespace {

using testing::data_folder;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::string error_of(const auto& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string source(const std::string& name) {
  return fmt::format(
      R"(<SimpleSource><SourceFilename relativeToVRT="1">{}</SourceFilename></SimpleSource>)",
      name);
}

std::string scaled(const std::string& name, int from, int to) {
  constexpr const char* text =
      R"(<SimpleSource resampling="lanczos"><SourceFilename relativeToVRT="1">{}</SourceFilename><SrcRect xOff="0" yOff="0" xSize="{}" ySize="{}"/><DstRect xOff="0" yOff="0" xSize="{}" ySize="{}"/></SimpleSource>)";
  return fmt::format(text, name, from, from, to, to);
}

std::string vrt(const std::string& content, const std::string& band = "") {
  return fmt::format(
      R"(<VRTDataset rasterXSize="8" rasterYSize="8"><VRTRasterBand dataType="Float32" band="1" {}>{}</VRTRasterBand></VRTDataset>)",
      band, content);
}

class RasterInput : public ::testing::Test {
 protected:
  RasterInput() {
    start_gdal();
    std::filesystem::copy_file(data_folder() / "terrain/prairie_1m.tif", folder_ / "sound.tif");
  }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  std::string error_of_text(const std::string& text) {
    const std::string path = write("dem.tif", text);
    return error_of([&] { load_dem(path); });
  }

  // Writes VRTs inside each other, each with `copies` of the next, and returns the outermost.
  std::string chain(int levels, int copies) {
    std::string inner = "sound.tif";
    for (int level = levels; level > 0; --level) {
      std::string content;
      for (int i = 0; i < copies; ++i) content += source(inner);
      inner = fmt::format("chain{}.vrt", level);
      write(inner, vrt(content));
    }
    return folder_ / inner;
  }

  TemporaryFolder folder_;
};

TEST_F(RasterInput, NamesOfFilesAreLocal) {
  struct Case {
    std::string name;
    std::string message;
  };
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const std::vector<Case> cases{
      {"/vsicurl/http://a.b/c.tif", "/vsicurl is not read: rasters must be local files"},
      {"/vsicurl?url=http://a.b/c.tif", "/vsicurl is not read"},
      {"/vsicurl\\http://a.b/c.tif", "/vsicurl is not read"},
      {"/vsizip/vsis3/a/b.zip/c.tif", "/vsis3 is not read"},
      {"/vsizip/{/vsigs/a/b.zip}/c.tif", "/vsigs is not read"},
      {"GTIFF_DIR:1:/vsiaz/a/b.tif", "/vsiaz is not read"},
      {"NETCDF:\"/vsicurl/http://a.b/c.nc\":z", "/vsicurl is not read"},
      {"/vsistdin/", "/vsistdin is not read"},
      {"PG:dbname=a", "there is no such file"},
      {"MEM:::DATAPOINTER=0x1000,PIXELS=9,LINES=9", "there is no such file"},
      {"<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"/>", "there is no such file"},
      {std::string(5000, 'a'), "its name has 5000 characters, more than the limit of 4096"},
      {folder_ / "pipe", "it is not a regular file"},
      {"/dev/zero", "it is not a regular file"},
      {folder_.path(), "it is a folder, but must be a file"},
  };
  for (const auto& [raster, message] : cases) {
    const std::string& name = raster;  // clang with OpenMP captures no structured binding
    EXPECT_THAT(error_of([&] { load_dem(name); }), HasSubstr(message));
    EXPECT_THAT(error_of_text(vrt(source("sound.tif") + "<SourceFilename><![CDATA[" + name +
                                  "]]></SourceFilename>")),
                HasSubstr(message));
  }
  EXPECT_EQ(error_of([&] { load_dem("GTIFF_DIR:1:" + (folder_ / "sound.tif").string()); }),
            "no error");
}

TEST_F(RasterInput, VrtsHoldOnlyMosaicsAndWarpsOfRasters) {
  write("notes.txt", "no raster");
  const std::string code = "<PixelFunctionType>sum</PixelFunctionType>" + source("sound.tif");
  const auto warped_by = [](const std::string& transformer) {
    return R"(<VRTDataset rasterXSize="8" rasterYSize="8" subClass="VRTWarpedDataset">)"
           R"(<GDALWarpOptions><SourceDataset relativeToVRT="1">sound.tif</SourceDataset>)"
           "<Transformer>" +
           transformer + "</Transformer></GDALWarpOptions></VRTDataset>";
  };
  std::string gcps;
  for (int i = 0; i <= 10'000; ++i) gcps += R"(<GCP Pixel="0" Line="0" X="0" Y="0"/>)";
  struct Case {
    std::string text;
    std::string message;
  };
  const std::vector<Case> cases{
      {vrt("<SourceFilename>/etc/passwd</SourceFilename>", R"(subClass="VRTRawRasterBand")"),
       "dem.tif has a VRTRawRasterBand; only mosaics and warps of files are read"},
      {vrt(code, R"(subClass="VRTDerivedRasterBand")"), "has a VRTDerivedRasterBand"},
      {vrt(code, R"(SUBCLASS="VRTDerivedRasterBand")"), "has a VRTDerivedRasterBand"},
      {vrt(code + "<subClass>VRTDerivedRasterBand</subClass>"), "has a VRTDerivedRasterBand"},
      {R"(<VRTDataset rasterXSize="8" rasterYSize="8" subClass="VRTPansharpenedDataset"/>)",
       "has a VRTPansharpenedDataset"},
      {vrt(R"(<SimpleSource><SourceFilename relativeToVRT="1">sound.tif</SourceFilename><OpenOptions><OOI key="ROOT_PATH">/tmp</OOI></OpenOptions></SimpleSource>)"),
       "dem.tif has a source with OpenOptions"},
      {warped_by("<TPSTransformer/>"), "has a warp by TPSTransformer; only mosaics and warps"},
      {warped_by("<GeoLocTransformer/>"),
       "has a warp by GeoLocTransformer; only mosaics and warps"},
      {warped_by("<RPCTransformer/>"), "has a warp by RPCTransformer; only mosaics and warps"},
      {warped_by("<GCPTransformer><GCPList>" + gcps + "</GCPList></GCPTransformer>"),
       "has more than 10000 ground control points"},
      {vrt(source("gone.tif")), "gone.tif: there is no such file"},
      {vrt(source("notes.txt")), "notes.txt: it cannot be opened as a raster: it is in none of"},
      {"<VRTDataset rasterXSize=\"8\"", "dem.tif cannot be read: Parse error"},
  };
  for (const auto& [text, message] : cases) EXPECT_THAT(error_of_text(text), HasSubstr(message));
  EXPECT_EQ(error_of_text(vrt(source("sound.tif"))), "no error");
  const std::string warp =
      fmt::format("gdalwarp -q -of VRT -tr 3 3 {} {}", (folder_ / "sound.tif").string(),
                  (folder_ / "warp.vrt").string());
  ASSERT_EQ(std::system(warp.c_str()), 0);
  EXPECT_EQ(error_of([&] { load_dem(folder_ / "warp.vrt"); }), "no error");
}

TEST_F(RasterInput, VrtsInsideVrtsAreLimited) {
  EXPECT_EQ(error_of([&] { load_dem(chain(4, 2)); }), "no error");
  EXPECT_THAT(error_of([&] { load_dem(chain(5, 1)); }),
              HasSubstr("chain5.vrt lies 5 levels deep in others, more than the limit of 4"));
  EXPECT_THAT(error_of([&] { load_dem(chain(10, 100)); }), HasSubstr("more than the limit of 4"));
  EXPECT_THAT(error_of([&] { load_dem(chain(4, 50)); }),
              HasSubstr("chain1.vrt has more than 1048576 sources"));
  EXPECT_THAT(error_of_text(vrt(source("dem.tif"))), HasSubstr("levels deep"));
  const std::string large = write("large.vrt", vrt(source("sound.tif")));
  std::filesystem::resize_file(large, (std::uintmax_t{64} << 20) + 1);
  EXPECT_THAT(error_of([&] { load_dem(large); }),
              HasSubstr("has 67108865 bytes, more than the limit of 67108864"));
}

TEST_F(RasterInput, WorkOfVrtsIsLimited) {
  const std::string overlapping =
      R"(<VRTDataset rasterXSize="8192" rasterYSize="8192"><VRTRasterBand dataType="Float32" band="1">{}</VRTRasterBand></VRTDataset>)";
  const auto copies = [](int count, const std::string& text) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
  };
  // 69 x 8192^2 samples; 68 are within 64 for each sample and 2^28 more.
  const auto vrt_of = [&](const std::string& content) {
    return write("many.vrt", fmt::format(fmt::runtime(overlapping), content));
  };
  EXPECT_NO_THROW(check_vrt(vrt_of(copies(68, scaled("sound.tif", 8, 8192)))));
  EXPECT_THAT(error_of([&] { check_vrt(vrt_of(copies(69, scaled("sound.tif", 8, 8192)))); }),
              HasSubstr("many.vrt, 4.63e+09 samples are written, more than the limit of 64"));
  // Of a VRT that is stretched, its own sources count as often.
  write("inner.vrt", vrt(copies(60, scaled("sound.tif", 8, 8))));
  EXPECT_THAT(error_of([&] { check_vrt(vrt_of(copies(2, scaled("inner.vrt", 8192, 8192)))); }),
              HasSubstr("samples are written, more than the limit of 64"));
  // What GDAL takes for the whole raster, for other sizes, or for no band.
  const std::string whole =
      R"(<SimpleSource><SourceFilename relativeToVRT="1">sound.tif</SourceFilename><DstRect/></SimpleSource>)";
  EXPECT_THAT(error_of([&] { check_vrt(vrt_of(copies(69, whole))); }),
              HasSubstr("samples are written, more than the limit of 64"));
  EXPECT_THAT(
      error_of_text(R"(<VRTDataset rasterXSize="8e4" rasterYSize="8e4"><VRTRasterBand>)" +
                    copies(10, scaled("sound.tif", 8, 8192)) + "</VRTRasterBand></VRTDataset>"),
      HasSubstr("for 64 samples of the VRT"));
  EXPECT_THAT(error_of([&] {
                check_vrt(vrt_of("<Metadata>" + copies(9, "<VRTRasterBand/>") + "</Metadata>" +
                                 copies(69, scaled("sound.tif", 8, 8192))));
              }),
              HasSubstr("samples are written, more than the limit of 64"));
  const std::string back = copies(100, scaled("sound.tif", 8, -8192));
  EXPECT_THAT(error_of([&] { check_vrt(vrt_of(back + copies(69, scaled("sound.tif", 8, 8192)))); }),
              HasSubstr("samples are written, more than the limit of 64"));
  // A mosaic of 1 m in cells of 60 m, and one that is too coarse.
  EXPECT_NO_THROW(check_vrt(vrt_of(scaled("sound.tif", 60 * 8192, 8192))));
  EXPECT_THAT(error_of([&] { check_vrt(vrt_of(scaled("sound.tif", 70 * 8192, 8192))); }),
              HasSubstr("samples of its sources are read, more than the limit of 4096"));
}

TEST_F(RasterInput, FewLinesOfTextMakeNoLargeRaster) {
  EXPECT_THAT(
      error_of([&] { load_dem(write("far.xyz", "0 0 1\n1 0 1\n0 1 2\n0 1000000000 2\n")); }),
      HasSubstr("its 33 bytes of text are 2 x 1000000001 samples, nearly all of them "
                "missing; does a line lie far from the others?"));
  EXPECT_EQ(error_of([&] { load_dem(write("near.xyz", "0 0 1\n1 0 1\n0 1 2\n1 1 2\n")); }),
            "no error");
}

TEST_F(RasterInput, CutFilesAreNotReadAsZeros) {
  const std::string sound = (folder_ / "sound.tif").string();
  const auto write_by_gdal = [&](const std::string& options, const std::string& name) {
    const std::string command =
        fmt::format("gdal_translate -q {} {} {}", options, sound, (folder_ / name).string());
    ASSERT_EQ(std::system(command.c_str()), 0);
  };
  const auto cut = [&](const std::string& name, double share) {
    const auto size = static_cast<double>(std::filesystem::file_size(folder_ / name));
    std::filesystem::resize_file(folder_ / name, static_cast<std::uintmax_t>(share * size));
  };
  const auto error_of_file = [&](const std::string& name) {
    return error_of([&] { load_dem(folder_ / name); });
  };
  write_by_gdal("-of JPEG -ot Byte -scale", "photo.jpg");
  EXPECT_EQ(error_of_file("photo.jpg"), "no error");
  cut("photo.jpg", 0.7);
  EXPECT_THAT(error_of_file("photo.jpg"), HasSubstr("cannot all be read: libjpeg: Premature end of "
                                                    "JPEG file; was the file cut short?"));
  write_by_gdal("-of HFA -ot Byte -scale -co USE_SPILL=YES -co NBITS=1", "mask.img");
  EXPECT_EQ(error_of_file("mask.img"), "no error");
  write_by_gdal("-of GTiff", "cut.tif");
  cut("cut.tif", 0.5);
  EXPECT_THAT(error_of_file("cut.tif"), HasSubstr("cannot all be read: a block is incomplete "
                                                  "or damaged; was the file cut short?"));
  write_by_gdal("-of HFA -co USE_SPILL=YES", "spill.img");
  EXPECT_EQ(error_of_file("spill.img"), "no error");
  cut("spill.ige", 0.9);
  EXPECT_THAT(error_of_file("spill.img"), HasSubstr("bytes by its header, but spill.ige has"));
  write_by_gdal("-of HFA", "whole.img");
  cut("whole.img", 0.9);
  EXPECT_THAT(error_of_file("whole.img"),
              HasSubstr("it cannot be opened as a raster: it ends too early; is it complete?"));
}

TEST_F(RasterInput, MemoryIsCheckedBeforeItIsTaken) {
  EXPECT_NO_THROW(check_memory("dem.tif", {8, 8}, 256));
  EXPECT_THAT(error_of([] {
                check_memory("dem.tif", {1 << 22, 1 << 22}, 0x1p46);
              }),
              HasSubstr("its 4194304 x 4194304 samples take 65536.0 GiB of memory, but "));
  // One block of the whole raster, in a sparse file.
  const std::string command = fmt::format(
      "gdal_create -q -of GTiff -ot Float32 -bands 1 -outsize 20000 20000 -co "
      "SPARSE_OK=YES -co COMPRESS=DEFLATE -co BLOCKYSIZE=20000 {}",
      (folder_ / "strip.tif").string());
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "there is no gdal_create";
  EXPECT_THAT(error_of([&] { load_dem(folder_ / "strip.tif"); }),
              HasSubstr("its blocks of 20000 x 20000 samples take 1.5 GiB each"));
  EXPECT_THAT(error_of([&] { read_bands(folder_ / "strip.tif", 100); }),
              HasSubstr("-co TILED=YES"));
}

}  // namespace
}  // namespace groundray::raster_input_test
