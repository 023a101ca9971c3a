
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <random>
#include <tuple>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::exr_reader_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

using Bits = std::vector<std::uint32_t>;

std::vector<std::string> names_of(const ExrFile& file) {
  std::vector<std::string> names;
  for (const ExrChannel& channel : file.channels) names.push_back(channel.name);
  return names;
}

template <typename T>
Bits bits_of(const Image<T>& image, std::size_t channel = 0) {
  Bits bits;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x)
      bits.push_back(std::bit_cast<std::uint32_t>(image.at(x, y)[channel]));
  }
  return bits;
}

template <typename T>
Bits bits_of(const ExrFile& file, const std::string& name) {
  const ExrChannel* channel = file.find(name);
  return channel != nullptr ? bits_of(std::get<Image<T>>(channel->image)) : Bits{};
}

template <typename T>
Image<T> random_image(int width, int height, int channels) {
  Image<T> image(width, height, channels);
  std::mt19937 random(7);
  for (T& value : image.values()) value = std::bit_cast<T>(static_cast<std::uint32_t>(random()));
  return image;
}

TEST(ReadExr, ReadsEveryWrittenBit) {
  const TemporaryFolder folder;
  ImageF floats = random_image<float>(19, 40, 3);
  floats.at(0, 0)[0] = -0.0f;
  floats.at(1, 0)[0] = std::numeric_limits<float>::infinity();
  floats.at(2, 0)[0] = std::bit_cast<float>(0x7fa00001u);  // a signalling NaN
  const auto ids = random_image<std::uint32_t>(19, 40, 2);
  write_exr(folder / "a.exr", {{{"Z", "R", "N.X"}, &floats}, {{"Instance", "a label"}, &ids}},
            {{"owner", "somebody"}, {"expTime", 0.1f}, {"worldToCamera", glm::mat4(2)}});
  const ExrFile file = read_exr(folder / "a.exr");
  EXPECT_EQ(std::tuple(file.width, file.height), std::tuple(19, 40));
  EXPECT_EQ(file.corner_px, glm::ivec2(0));
  EXPECT_EQ(file.display_size_px, glm::ivec2(19, 40));
  EXPECT_THAT(names_of(file), ElementsAre("Instance", "N.X", "R", "Z", "a label"));
  EXPECT_EQ(bits_of<float>(file, "Z"), bits_of(floats, 0));
  EXPECT_EQ(bits_of<float>(file, "R"), bits_of(floats, 1));
  EXPECT_EQ(bits_of<float>(file, "N.X"), bits_of(floats, 2));
  EXPECT_EQ(bits_of<std::uint32_t>(file, "Instance"), bits_of(ids, 0));
  EXPECT_EQ(bits_of<std::uint32_t>(file, "a label"), bits_of(ids, 1));
  EXPECT_EQ(file.attributes.at("owner"), "somebody");
  EXPECT_EQ(file.attributes.at("expTime"), "0.1");
  EXPECT_EQ(file.attributes.at("worldToCamera"), "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 2");
  EXPECT_EQ(file.find("r"), nullptr);
}

// Images as other programs write them: each value is 100 y + x, in halves and floats.
struct Ramp {
  std::vector<half> halves;
  std::vector<float> floats;
  Imf::FrameBuffer pixels;

  explicit Ramp(const Imath::Box2i& window) {
    const auto width = static_cast<std::size_t>(window.size().x) + 1;
    for (int y = window.min.y; y <= window.max.y; ++y) {
      for (int x = window.min.x; x <= window.max.x; ++x) {
        halves.emplace_back(static_cast<float>(100 * y + x));
        floats.push_back(static_cast<float>(100 * y + x) + 0.5f);
      }
    }
    pixels.insert("R", Imf::Slice::Make(Imf::HALF, halves.data(), window, 2, 2 * width));
    pixels.insert("Z", Imf::Slice::Make(Imf::FLOAT, floats.data(), window, 4, 4 * width));
  }
};

Imf::Header header_of(const Imath::Box2i& display, const Imath::Box2i& data,
                      Imf::Compression compression) {
  Imf::Header header(display, data);
  header.channels().insert("R", Imf::Channel(Imf::HALF));
  header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  header.compression() = compression;
  return header;
}

void expect_ramp(const ExrFile& file, glm::ivec2 first, const std::string& prefix = "") {
  ASSERT_NE(file.find(prefix + "R"), nullptr);
  ASSERT_NE(file.find(prefix + "Z"), nullptr);
  const auto& red = std::get<ImageF>(file.find(prefix + "R")->image);
  const auto& depth = std::get<ImageF>(file.find(prefix + "Z")->image);
  for (int y = 0; y < file.height; ++y) {
    for (int x = 0; x < file.width; ++x) {
      const auto value = static_cast<float>(100 * (y + first.y) + x + first.x);
      ASSERT_EQ(red.at(x, y)[0], value)
          << x << ", " << y;  // halves represent integers up to 2048 exactly
      ASSERT_EQ(depth.at(x, y)[0], value + 0.5f) << x << ", " << y;
    }
  }
}

TEST(ReadExr, ReadsLosslessCompressionsAndCroppedImages) {
  const TemporaryFolder folder;
  const Imath::Box2i display({2, 1}, {30, 18}), data({5, 3}, {14, 19});
  for (const Imf::Compression compression :
       {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
        Imf::PIZ_COMPRESSION}) {
    Imf::Header header = header_of(display, data, compression);
    header.lineOrder() = Imf::DECREASING_Y;
    {
      const Ramp ramp(data);
      Imf::OutputFile out((folder / "a.exr").c_str(), header);
      out.setFrameBuffer(ramp.pixels);
      out.writePixels(17);
    }
    const ExrFile file = read_exr(folder / "a.exr");
    EXPECT_EQ(std::tuple(file.width, file.height), std::tuple(10, 17));
    EXPECT_EQ(file.corner_px, glm::ivec2(3, 2));
    EXPECT_EQ(file.display_size_px, glm::ivec2(29, 18));
    expect_ramp(file, {5, 3});
  }
}

TEST(ReadExr, ReadsTheFinestLevelOfTiles) {
  const TemporaryFolder folder;
  const Imath::Box2i data({0, 0}, {36, 17});
  for (const Imf::LevelMode mode : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS}) {
    Imf::Header header = header_of(data, data, Imf::ZIP_COMPRESSION);
    header.setTileDescription(Imf::TileDescription(16, 8, mode));
    {
      const Ramp ramp(data);
      Imf::TiledOutputFile out((folder / "a.exr").c_str(), header);
      out.setFrameBuffer(ramp.pixels);
      for (int level = 0; level < out.numLevels(); ++level)
        out.writeTiles(0, out.numXTiles(level) - 1, 0, out.numYTiles(level) - 1, level);
    }
    expect_ramp(read_exr(folder / "a.exr"), {0, 0});
  }
}

// Writes parts with these names, the second with `second` pixels.
void write_parts(const std::filesystem::path& path, const std::vector<std::string>& names,
                 const Imath::Box2i& second) {
  const Imath::Box2i data({0, 0}, {8, 4});
  std::vector<Imf::Header> headers;
  for (std::size_t i = 0; i < names.size(); ++i) {
    headers.push_back(header_of(data, i == 1 ? second : data, Imf::ZIP_COMPRESSION));
    headers.back().setName(names[i]);
    headers.back().setType(i == 1 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    if (i == 1) headers.back().setTileDescription(Imf::TileDescription(4, 4));
  }
  Imf::MultiPartOutputFile out(path.c_str(), headers.data(), static_cast<int>(names.size()));
  for (int i = 0; i < static_cast<int>(names.size()); ++i) {
    const Ramp ramp(headers[static_cast<std::size_t>(i)].dataWindow());
    if (i == 1) {
      Imf::TiledOutputPart part(out, i);
      part.setFrameBuffer(ramp.pixels);
      part.writeTiles(0, part.numXTiles() - 1, 0, part.numYTiles() - 1);
    } else {
      Imf::OutputPart part(out, i);
      part.setFrameBuffer(ramp.pixels);
      part.writePixels(5);
    }
  }
}

TEST(ReadExr, PrefixesChannelsOfFurtherPartsWithTheirNames) {
  const TemporaryFolder folder;
  write_parts(folder / "a.exr", {"beauty", "truth"}, {{0, 0}, {8, 4}});
  const ExrFile file = read_exr(folder / "a.exr");
  EXPECT_THAT(names_of(file), ElementsAre("R", "Z", "truth.R", "truth.Z"));
  expect_ramp(file, {0, 0});
  expect_ramp(file, {0, 0}, "truth.");
}

TEST(ReadExr, RejectsPartsAndChannelsThatDoNotShareThePixelGrid) {
  const TemporaryFolder folder;
  const auto read = [&] { read_exr(folder / "a.exr"); };
  write_parts(folder / "a.exr", {"beauty", "truth"}, {{0, 0}, {7, 4}});
  EXPECT_THAT(read,
              ThrowsMessage<Error>(AllOf(HasSubstr("a.exr: its parts differ in size or position"),
                                         HasSubstr("exrmultipart"))));
  Imf::Header header(8, 8);
  std::vector<float> values(64);
  {
    header.channels().insert("RY", Imf::Channel(Imf::FLOAT, 2, 2));
    Imf::FrameBuffer pixels;
    pixels.insert("RY",
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 16, 2, 2));
    Imf::OutputFile out((folder / "a.exr").c_str(), header);
    out.setFrameBuffer(pixels);
    out.writePixels(8);
  }
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("its channel RY is subsampled by 2 x 2")));
}

TEST(ReadExr, RejectsDeepPixels) {
  const TemporaryFolder folder;
  {
    Imf::Header header(2, 2);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    std::vector<unsigned> counts(4, 0);
    std::vector<float*> samples(4, nullptr);
    Imf::DeepFrameBuffer pixels;
    pixels.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), 4, 8));
    pixels.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples.data()),
                                      sizeof(float*), 2 * sizeof(float*), sizeof(float)));
    Imf::DeepScanLineOutputFile out((folder / "a.exr").c_str(), header);
    out.setFrameBuffer(pixels);
    out.writePixels(2);
  }
  EXPECT_THAT([&] { read_exr(folder / "a.exr"); },
              ThrowsMessage<Error>(HasSubstr("deep pixels are not supported")));
}

std::string message_of(std::string_view bytes) {
  try {
    parse_exr(bytes, "a.exr");
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(ReadExr, RejectsFilesThatAreNotOpenExr) {
  EXPECT_THAT(message_of(""), HasSubstr("a.exr: it is not an OpenEXR (.exr) image: it is empty"));
  EXPECT_THAT(message_of("\x89PNG"), HasSubstr("despite its name: convert it"));
  EXPECT_THAT([] { read_exr("/nowhere/a.exr"); },
              ThrowsMessage<Error>(HasSubstr("/nowhere/a.exr: there is no such file")));
}

// OpenEXR allocates a text of the declared size before it reads the text. The file was found by
// fuzzing; OpenEXR needs 1.9 GB for it.
TEST(ReadExr, RejectsAttributesLargerThanTheFile) {
  const TemporaryFolder folder;
  write_parts(folder / "a.exr", {"beauty", "truth"}, {{0, 0}, {8, 4}});
  const std::string whole = read_text(folder / "a.exr");
  using namespace std::string_view_literals;
  constexpr std::string_view name = "name\0string\0"sv;
  for (const std::size_t at : {whole.find(name), whole.rfind(name)}) {
    ASSERT_NE(at, std::string::npos);
    for (const auto size : {"urin"sv, "\xff\xff\xff\xff"sv}) {
      std::string bytes = whole;
      bytes.replace(at + name.size(), 4, size);
      const auto is_rejected =
          AllOf(HasSubstr("a.exr: it is truncated or damaged: Attribute 'name', type 'string': "),
                HasSubstr(size == "urin" ? "1852404341" : "-1"));
      EXPECT_THAT(message_of(bytes), is_rejected);
      EXPECT_THAT([&] { parse_heights(bytes, "a.exr"); }, ThrowsMessage<Error>(is_rejected));
    }
  }
}

// OpenEXR's C++ reader reads a list of channels up to its end, wherever the declared size puts it.
TEST(ReadExr, RejectsAttributesWhoseSizeContradictsTheirType) {
  const TemporaryFolder folder;
  const ImageF light = random_image<float>(9, 5, 3);
  write_exr(folder / "a.exr", {{{"R", "G", "B"}, &light}});
  std::string bytes = read_text(folder / "a.exr");
  using namespace std::string_view_literals;
  constexpr std::string_view name = "channels\0chlist\0"sv;
  const std::size_t at = bytes.find(name);
  ASSERT_NE(at, std::string::npos);
  bytes[at + name.size()] = static_cast<char>(bytes[at + name.size()] - 2);
  EXPECT_THAT(message_of(bytes), HasSubstr("a.exr: it is truncated or damaged: "));
}

// Every prefix of a file is rejected, and damaged files cause at most an Error.
TEST(ReadExr, RejectsTruncatedFilesAndSurvivesDamage) {
  const TemporaryFolder folder;
  const ImageF light = random_image<float>(9, 5, 3);
  write_exr(folder / "a.exr", {{{"R", "G", "B"}, &light}});
  write_parts(folder / "b.exr", {"beauty", "truth"}, {{0, 0}, {8, 4}});
  std::mt19937 random(3);
  ::testing::internal::CaptureStderr();
  for (const char* name : {"a.exr", "b.exr"}) {
    const std::string whole = read_text(folder / name);
    EXPECT_EQ(message_of(whole), "none");
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_THAT(message_of(std::string_view(whole).substr(0, size)), HasSubstr("a.exr: "));
    for (int i = 0; i < 1000; ++i) {
      std::string bytes = whole;
      bytes[8 + random() % (bytes.size() - 8)] = static_cast<char>(random());
      EXPECT_THAT(message_of(bytes), ::testing::AnyOf("none", HasSubstr("a.exr: ")));
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace groundray::exr_reader_test
