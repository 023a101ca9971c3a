#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/interruption.h"
#include "apps/view/load_input.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"
#include "test/view/opened_samples.h"
#include "test/view/sample_dataset.h"

namespace groundray::load_input_faults_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::OpenedSamples;
using testing::read_bytes;
using testing::SampleDataset;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;
using testing::write_bytes;

TEST(OpenFaults, ReportsFilesThatCannotBeShown) {
  TemporaryFolder folder;
  EXPECT_THAT([&] { open_any(folder / "absent.ply"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("absent.ply"), HasSubstr("no such file"))));
  EXPECT_THAT([&] { open_any(folder.path()); }, ThrowsMessage<Error>(HasSubstr("no dataset.yaml")));
  write_bytes(folder / "letter.txt", "Dear reader,\n");
  EXPECT_THAT(
      [&] { open_any(folder / "letter.txt"); },
      ThrowsMessage<Error>(AllOf(HasSubstr("letter.txt"), HasSubstr("it cannot be shown"))));
  write_bytes(folder / "empty.ply",
              "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
              "property float z\nend_header\n");
  EXPECT_THAT([&] { open_any(folder / "empty.ply"); },
              ThrowsMessage<Error>(HasSubstr("empty.ply")));
}

// Encodes a number in `bytes` bytes, big-endian.
std::string big_endian(std::uint64_t number, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i)
    text += static_cast<char>((number >> (8 * static_cast<unsigned>(i))) & 0xffU);
  return text;
}
std::string little_endian(std::uint64_t number, int bytes) {
  const std::string text = big_endian(number, bytes);
  return {text.rbegin(), text.rend()};
}

std::string with(std::string text, std::size_t at, const std::string& other) {
  return text.replace(at, other.size(), other);
}

// Sets both windows of an OpenEXR file to 60000 px in width and height.
std::string with_wide_windows(std::string exr) {
  for (const std::string name : {"dataWindow", "displayWindow"}) {
    const std::size_t box = exr.find(name) + name.size() + std::string("0box2i0").size() + 4;
    exr.replace(box + 8, 8, little_endian(59'999, 4) + little_endian(59'999, 4));
  }
  return exr;
}

// Small files that announce 10^10 and more samples, points or pixels.
TEST(OpenFaults, RejectsOversizedFiles) {
  const OpenedSamples& samples = OpenedSamples::get();
  const std::string jpeg = read_bytes(samples["picture.jpg"]);
  const std::string photo =
      "<VRTDataset rasterXSize=\"60000\" rasterYSize=\"60000\"><VRTRasterBand dataType=\"Byte\" "
      "band=\"1\"/><VRTRasterBand dataType=\"Byte\" band=\"2\"/><VRTRasterBand dataType=\"Byte\" "
      "band=\"3\"/></VRTDataset>";
  const std::string vertices =
      "ply\nformat binary_little_endian 1.0\nelement vertex 900000000000\n"
      "property float x\nproperty float y\nproperty float z\n";
  const std::string array = "{'descr': '<f4', 'fortran_order': False, 'shape': (90000000000, 3), }";
  const std::vector<std::pair<std::string, std::string>> files = {
      {"world.vrt",
       "<VRTDataset rasterXSize=\"100000\" rasterYSize=\"100000\"><GeoTransform>0,1,0,0,0,-1"
       "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\"/></VRTDataset>"},
      {"photo.vrt", photo},
      {"huge.png",
       with(read_bytes(samples["picture.png"]), 16, big_endian(60'000, 4) + big_endian(60'000, 4))},
      {"huge.jpg",
       with(jpeg, jpeg.find("\xff\xc0") + 5, big_endian(65'500, 2) + big_endian(65'500, 2))},
      {"huge.exr", with_wide_windows(read_bytes(samples["light.exr"]))},
      {"huge.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n1234"},
      {"huge.ply", vertices + "end_header\n1234"},
      {"faces.ply", vertices + "element face 900000000000\n"
                               "property list uchar int vertex_index\nend_header\n1234"},
      {"huge.stl", with(read_bytes(samples["mesh.stl"]), 80, little_endian(4'000'000'000, 4))},
      {"huge.pcd",
       "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH "
       "4000000000\nHEIGHT 9\nPOINTS 36000000000\nDATA binary\n1234"},
      {"huge.npy", "\x93NUMPY\x01" + std::string(1, '\0') + little_endian(array.size(), 2) + array},
  };
  TemporaryFolder folder;
  for (const auto& [name, bytes] : files) {
    write_bytes(folder / name, bytes);
    try {
      open_any(folder / name);
      ADD_FAILURE() << name << " was opened";
    } catch (const Error& fault) {
      EXPECT_THAT(fault.what(), HasSubstr(name));
    }
  }
  EXPECT_THAT([&] { open_any(folder / "world.vrt"); },
              ThrowsMessage<Error>(HasSubstr("terrain certify")));
}

// Copies of a file, truncated at several positions or with single bits inverted.
std::vector<std::string> broken(const std::string& whole) {
  std::vector<std::string> all;
  for (const double share : {0.0, 0.1, 0.35, 0.7, 0.98})
    all.push_back(whole.substr(0, static_cast<std::size_t>(share * double(whole.size()))));
  for (std::size_t i = 0; i < 20; ++i) {
    all.push_back(whole);
    all.back()[(i * 2654435761U) % std::min<std::size_t>(whole.size(), 400)] ^=
        static_cast<char>(1U << (i % 8));
  }
  return all;
}

// Whatever the damage, a file either opens or is rejected with a message that names it.
TEST(OpenFaults, RejectsBrokenFiles) {
  TemporaryFolder folder;
  int refused = 0;
  for (const char* const name :
       {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb", "cloud.pcd", "cloud.ply", "cloud.npy",
        "cloud.npz", "cloud.bin", "fused.tif", "hills.asc", "picture.png", "picture.jpg",
        "light.exr", "light.hdr", "photo.tif"}) {
    int of_kind = 0;
    for (const std::string& bytes : broken(read_bytes(OpenedSamples::get()[name]))) {
      write_bytes(folder / name, bytes);
      try {
        open_any(folder / name);
      } catch (const Error& fault) {
        EXPECT_THAT(fault.what(), HasSubstr(name));
        ++of_kind;
      }
    }
    EXPECT_GT(of_kind, 0) << name;
    refused += of_kind;
  }
  EXPECT_GT(refused, 80);
}

// As for single files, but the damaged file may be one that the scene or the dataset names.
TEST(OpenFaults, RejectsBrokenScenesAndDatasets) {
  TemporaryFolder folder;
  const std::filesystem::path scene = folder / "scene", dataset = folder / "dataset";
  std::filesystem::create_directory(scene);
  testing::write_sample_scene(scene, testing::sample_scene());
  std::filesystem::copy(SampleDataset::get().path(), dataset,
                        std::filesystem::copy_options::recursive);
  const std::vector<std::pair<std::filesystem::path, std::filesystem::path>> inputs = {
      {scene / "scene.yaml", scene / "scene.yaml"}, {scene / "scene.yaml", scene / "body.tum"},
      {scene / "scene.yaml", scene / "eye.yaml"},   {dataset, dataset / "dataset.yaml"},
      {dataset, dataset / "lidar/top/000000.ply"},  {dataset, dataset / "poses/top.tum"},
  };
  for (const auto& [opened, file] : inputs) {
    int refused = 0;
    const std::string whole = read_bytes(file);
    for (const std::string& bytes : broken(whole)) {
      write_bytes(file, bytes);
      try {
        open_any(opened);
      } catch (const Error& fault) {
        EXPECT_THAT(fault.what(), HasSubstr(folder.path().string()));
        ++refused;
      }
    }
    write_bytes(file, whole);
    EXPECT_GT(refused, 0) << file;
    EXPECT_NO_THROW(open_any(opened)) << file;
  }
}

// Opening stops when it is no longer wanted.
TEST(OpenFaults, StopsOnRequest) {
  std::stop_source stop;
  stop.request_stop();
  TemporaryFolder folder;
  const std::vector<std::filesystem::path> inputs = {
      testing::write_sample_scene(folder.path(), testing::sample_scene()),
      SampleDataset::get().path(),
      OpenedSamples::get()["mesh.ply"],
      OpenedSamples::get()["cloud.pcd"],
      OpenedSamples::get()["hills.asc"],
      OpenedSamples::get()["picture.png"]};
  for (const auto& input : inputs)
    EXPECT_THROW(open_any(input, {}, stop.get_token()), Interrupted) << input;
}

}  // namespace
}  // namespace groundray::load_input_faults_test
