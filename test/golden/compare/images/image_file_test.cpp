#include "apps/golden/compare/images/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/flow_io.h"
#include "core/image/png_io.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::image_file_test {
namespace {

using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsNan;
using ::testing::Pair;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

std::vector<std::pair<std::string, std::string>> grouped(const std::vector<std::string>& names) {
  std::vector<NamedChannel> channels;
  for (const std::string& name : names) channels.push_back({name, Image<double>(1, 1, 1)});
  std::vector<std::pair<std::string, std::string>> result;
  for (const ImageLayer& layer : layers_of(std::move(channels))) {
    std::string joined;
    for (const std::string& channel : layer.channels) joined += channel + " ";
    result.emplace_back(layer.name, joined);
  }
  return result;
}

TEST(ImageLayers, RecogniseChannelNamesOfGroundray) {
  EXPECT_THAT(grouped({"Albedo.B",
                       "Albedo.G",
                       "Albedo.R",
                       "B",
                       "Bound",
                       "Coverage.3",
                       "Distance",
                       "FlowForward.seen",
                       "FlowForward.u",
                       "FlowForward.v",
                       "G",
                       "Label",
                       "N.X",
                       "N.Y",
                       "N.Z",
                       "Ns.X",
                       "Ns.Y",
                       "Ns.Z",
                       "R",
                       "StdError.B",
                       "StdError.G",
                       "StdError.R",
                       "Samples",
                       "Valid",
                       "Z"}),
              UnorderedElementsAre(
                  Pair("Albedo", "Albedo.R Albedo.G Albedo.B "), Pair("RGB", "R G B "),
                  Pair("Bound", "Bound "), Pair("Coverage.3", "Coverage.3 "),
                  Pair("Distance", "Distance "), Pair("FlowForward.seen", "FlowForward.seen "),
                  Pair("FlowForward", "FlowForward.u FlowForward.v "), Pair("Label", "Label "),
                  Pair("N", "N.X N.Y N.Z "), Pair("Ns", "Ns.X Ns.Y Ns.Z "),
                  Pair("StdError", "StdError.R StdError.G StdError.B "),
                  Pair("Samples", "Samples "), Pair("Valid", "Valid "), Pair("Z", "Z ")));
}

TEST(ImageLayers, RecogniseChannelNamesOfOtherPrograms) {
  EXPECT_THAT(
      grouped({"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
               "ViewLayer.Combined.A", "ViewLayer.Depth.Z", "ViewLayer.Normal.X",
               "ViewLayer.Normal.Y", "ViewLayer.Normal.Z"}),
      UnorderedElementsAre(
          Pair("RGB", "ViewLayer.Combined.R ViewLayer.Combined.G ViewLayer.Combined.B "),
          Pair("ViewLayer.Combined.A", "ViewLayer.Combined.A "), Pair("Z", "ViewLayer.Depth.Z "),
          Pair("N", "ViewLayer.Normal.X ViewLayer.Normal.Y ViewLayer.Normal.Z ")));
  EXPECT_THAT(
      grouped({"dd.y.T", "sh_normal.X", "sh_normal.Y", "sh_normal.Z", "depth", "flow.x", "flow.y",
               "semantic"}),
      UnorderedElementsAre(Pair("Distance", "dd.y.T "),
                           Pair("Ns", "sh_normal.X sh_normal.Y sh_normal.Z "), Pair("Z", "depth "),
                           Pair("FlowForward", "flow.x flow.y "), Pair("Label", "semantic ")));
}

TEST(ImageLayers, KeepIncompleteAndDuplicateChannelsSeparate) {
  EXPECT_THAT(grouped({"N.X", "N.Y", "Z", "depth.V", "foo.bar"}),
              UnorderedElementsAre(Pair("N.X", "N.X "), Pair("N.Y", "N.Y "), Pair("Z", "Z "),
                                   Pair("depth.V", "depth.V "), Pair("foo.bar", "foo.bar ")));
}

const Image<double>& values_of(const ImageFile& file, const char* layer) {
  const ImageLayer* found = file.find(layer);
  if (found == nullptr) throw Error("there is no layer {}", layer);
  return found->values;
}

TEST(ImageFile, AppliesUnitsAndChannelNames) {
  const TemporaryFolder folder;
  ImageF depth(3, 2, 1);
  depth.at(2, 1)[0] = 1500;
  write_exr(folder / "a.exr", {{{"mine"}, &depth}});
  const ImageFile file = read_image_file(
      folder / "a.exr", {.png = {}, .depth_unit_m = 1e-3, .names = {{"mine", "Distance"}}});
  EXPECT_EQ(file.size_px, glm::ivec2(3, 2));
  EXPECT_DOUBLE_EQ(values_of(file, "Distance").at(2, 1)[0], 1.5);
  EXPECT_THAT(
      [&] {
        read_image_file(folder / "a.exr", {.png = {}, .depth_unit_m = 1, .names = {{"his", "Z"}}});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("a.exr: it has no channel 'his'; it has mine"))));
}

// Moves the display window one pixel to the left and enlarges it.
TEST(ImageFile, PlacesTheDataWindowInTheDisplayWindow) {
  const TemporaryFolder folder;
  ImageF depth(2, 2, 1);
  depth.at(0, 0)[0] = 5;
  write_exr(folder / "a.exr", {{{"Z"}, &depth}});
  std::string bytes = read_text(folder / "a.exr");
  const std::string key("displayWindow\0box2i\0", 20);
  const std::size_t at = bytes.find(key) + key.size() + 4;
  const std::array<std::int32_t, 4> window{-1, 0, 2, 1};
  std::memcpy(bytes.data() + at, window.data(), sizeof window);
  write_text(folder / "b.exr", bytes);
  const ImageFile file = read_image_file(folder / "b.exr");
  EXPECT_EQ(file.size_px, glm::ivec2(4, 2));
  const Image<double>& values = values_of(file, "Z");
  EXPECT_THAT(values.at(0, 0), ElementsAre(IsNan()));
  EXPECT_THAT(values.at(1, 0), ElementsAre(5));
  EXPECT_THAT(values.at(2, 1), ElementsAre(0));
  EXPECT_THAT(values.at(3, 1), ElementsAre(IsNan()));
}

TEST(ImageFile, ReadsPngAsSpecified) {
  const TemporaryFolder folder;
  Image16 codes(2, 1, 1);
  codes.at(1, 0)[0] = 2570;
  write_png(folder / "a.png", codes);
  const auto depth_of = [&](PngMeaning png) {
    return values_of(read_image_file(folder / "a.png", {.png = png, .names = {}}), "Z");
  };
  EXPECT_THAT(depth_of(PngMeaning::KittiDepth).values(), ElementsAre(IsNan(), 2570.0 / 256));
  EXPECT_THAT(depth_of(PngMeaning::MillimetreDepth).values(),
              ElementsAre(IsNan(), ::testing::DoubleEq(2.57)));
  const ImageFile labels =
      read_image_file(folder / "a.png", {.png = PngMeaning::Label, .names = {}});
  EXPECT_THAT(values_of(labels, "Label").values(), ElementsAre(0, 2570));
  const ImageFile picture = read_image_file(folder / "a.png");
  constexpr double grey = 2570.0 / 65535;
  EXPECT_THAT(values_of(picture, "Picture").values(), ElementsAre(0, 0, 0, grey, grey, grey));
  write_png(folder / "b.png", Image8(2, 1, 3));
  EXPECT_THAT([&] { read_image_file(folder / "b.png", {.png = PngMeaning::KittiDepth}); },
              ThrowsMessage<Error>(HasSubstr("b.png: depths must be one channel of 16 bits; it has "
                                             "3 of 8: is it a picture?")));
  EXPECT_THAT([&] { read_image_file(folder / "b.png", {.png = PngMeaning::KittiFlow}); },
              ThrowsMessage<Error>(HasSubstr("KITTI's flow must be three channels of 16 bits")));
}

TEST(ImageFile, ReadsFlowOfKittiAndMiddlebury) {
  const TemporaryFolder folder;
  ImageF flow(2, 1, 2);
  flow.at(0, 0)[0] = 1.5f;
  flow.at(0, 0)[1] = -20.25f;
  flow.at(1, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  write_flo(folder / "a.flo", flow);
  write_kitti_flow(folder / "a.png", flow);
  for (const char* name : {"a.flo", "a.png"}) {
    const ImageFile file =
        read_image_file(folder / name, {.png = PngMeaning::KittiFlow, .names = {}});
    EXPECT_THAT(values_of(file, "FlowForward").values(),
                ElementsAre(1.5, -20.25, IsNan(), IsNan()));
  }
  const std::string whole = read_text(folder / "a.flo");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write_text(folder / "b.flo", whole.substr(0, size));
    EXPECT_THROW(read_image_file(folder / "b.flo"), Error) << size;
  }
}

std::string floats(const std::vector<float>& values, bool is_big) {
  std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * 4);
  if (!is_big) return bytes;
  for (std::size_t i = 0; i < bytes.size(); i += 4)
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                 bytes.begin() + static_cast<std::ptrdiff_t>(i) + 4);
  return bytes;
}

TEST(ImageFile, ReadsPfmBottomUpInBothByteOrders) {
  const TemporaryFolder folder;
  write_text(folder / "a.pfm", "Pf\n2 2\n-1.0\n" + floats({3, 4, 1, 2}, false));
  write_text(folder / "b.pfm", "Pf\n2 2\n1\n" + floats({3, 4, 1, 2}, true));
  for (const char* name : {"a.pfm", "b.pfm"})
    EXPECT_THAT(values_of(read_image_file(folder / name), "Z").values(), ElementsAre(1, 2, 3, 4));
  write_text(folder / "c.pfm", "PF\n1 1\n-1\n" + floats({3, 4, 5}, false));
  EXPECT_THAT(values_of(read_image_file(folder / "c.pfm"), "RGB").values(), ElementsAre(3, 4, 5));
  write_text(folder / "c.pfm", "PF\n1 1\n-1\n" + floats({3, 4}, false));
  EXPECT_THAT([&] { read_image_file(folder / "c.pfm"); },
              ThrowsMessage<Error>(HasSubstr("it has 8 bytes of pixels; 1 x 1 of 3 x 4 bytes")));
  write_text(folder / "c.pfm", "Pf\n1 x\n-1\n");
  EXPECT_THAT([&] { read_image_file(folder / "c.pfm"); },
              ThrowsMessage<Error>(HasSubstr("its header must be PF or Pf")));
}

TEST(ImageFile, RejectsOtherFiles) {
  const TemporaryFolder folder;
  write_text(folder / "a.png", "");
  EXPECT_THAT(
      [&] { read_image_file(folder / "a.png"); },
      ThrowsMessage<Error>(AllOf(HasSubstr("a.png: it is not an image that can be compared"),
                                 HasSubstr("empty file"))));
  write_text(folder / "a.png", "hello");
  EXPECT_THAT([&] { read_image_file(folder / "a.png"); },
              ThrowsMessage<Error>(HasSubstr("convert it")));
  write_text(folder / "a.png", "\x89PNG\r\n\x1a\nhello, I am a PNG with sixteen bits");
  EXPECT_THAT([&] { read_image_file(folder / "a.png"); },
              ThrowsMessage<Error>(HasSubstr("truncated or damaged")));
  EXPECT_THAT([&] { read_image_file("/nowhere.exr"); },
              ThrowsMessage<Error>(HasSubstr("/nowhere.exr: there is no such file")));
}

}  // namespace
}  // namespace groundray::golden::image_file_test
