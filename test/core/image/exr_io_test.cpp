#include "core/image/exr_io.h"

#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <glm/ext/matrix_transform.hpp>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/file_size_limit.h"
#include "test/support/temporary_folder.h"

namespace groundray::exr_io_test {
namespace {

using ::testing::AllOf;
using testing::FileSizeLimit;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

ImageF odd_floats() {
  using Limits = std::numeric_limits<float>;
  ImageF image(19, 40, 3);  // more rows than the 16 of a block
  std::mt19937 random(2);
  for (float& value : image.values())
    value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
  const float odd[] = {-0.0f, Limits::infinity(), Limits::quiet_NaN(), Limits::denorm_min(),
                       Limits::max()};
  std::ranges::copy(odd, image.values().begin());
  return image;
}

Image32 odd_ids() {
  Image32 image(19, 40, 2);
  std::mt19937 random(5);
  for (std::uint32_t& value : image.values()) value = static_cast<std::uint32_t>(random());
  image.values()[0] = std::numeric_limits<std::uint32_t>::max();
  return image;
}

// Compares a channel of a file bit by bit with one of an image.
template <typename T>
void expect_equal(Imf::InputFile& file, const std::string& name, Imf::PixelType type,
                  const Image<T>& image, std::size_t channel) {
  ASSERT_NE(file.header().channels().findChannel(name), nullptr) << name;
  EXPECT_EQ(file.header().channels().findChannel(name)->type, type);
  Imf::Array2D<T> pixels(40, 19);
  Imf::FrameBuffer buffer;
  buffer.insert(name,
                Imf::Slice(type, reinterpret_cast<char*>(&pixels[0][0]), 4, std::size_t{4} * 19));
  file.setFrameBuffer(buffer);
  file.readPixels(0, 39);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 19; ++x) {
      ASSERT_EQ(std::bit_cast<std::uint32_t>(pixels[y][x]),
                std::bit_cast<std::uint32_t>(image.at(x, y)[channel]))
          << name << " at " << x << ", " << y;
    }
  }
}

TEST(WriteExr, KeepsEveryBitOfFloatsAndIntegers) {
  const TemporaryFolder folder;
  const ImageF floats = odd_floats();
  const Image32 ids = odd_ids();
  write_exr(folder / "a.exr", {{{"Z", "R", "normal.x"}, &floats}, {{"instance", "a label"}, &ids}});
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
  ASSERT_EQ(file.header().dataWindow(), Imath::Box2i({0, 0}, {18, 39}));
  expect_equal(file, "Z", Imf::FLOAT, floats, 0);
  expect_equal(file, "R", Imf::FLOAT, floats, 1);
  expect_equal(file, "normal.x", Imf::FLOAT, floats, 2);
  expect_equal(file, "instance", Imf::UINT, ids, 0);
  expect_equal(file, "a label", Imf::UINT, ids, 1);
}

TEST(WriteExr, WritesAttributes) {
  const TemporaryFolder folder;
  const ImageF image(2, 2, 1);
  // Maps the point (1, 2, 3) to (11, 22, 33).
  const glm::mat4 matrix = glm::translate(glm::mat4(1), {10, 20, 30});
  write_exr(folder / "a.exr", {{{"Y"}, &image}},
            {{"owner", "somebody"},
             {"camera:model", "KannalaBrandt"},
             {"expTime", 0.005f},
             {"worldToCamera", matrix}});
  const Imf::InputFile file((folder / "a.exr").c_str());
  const Imf::Header& header = file.header();
  EXPECT_EQ(Imf::owner(header), "somebody");
  EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("camera:model").value(), "KannalaBrandt");
  EXPECT_EQ(Imf::expTime(header), 0.005f);
  EXPECT_EQ(Imath::V3f(1, 2, 3) * Imf::worldToCamera(header), Imath::V3f(11, 22, 33));
}

TEST(WriteExr, BytesDoNotDependOnTheNumberOfThreads) {
  const TemporaryFolder folder;
  const ImageF floats = odd_floats();
  const Image32 ids = odd_ids();
  const int before = Imf::globalThreadCount();
  for (const int threads : {0, 1, 4}) {
    Imf::setGlobalThreadCount(threads);
    write_exr(folder / std::to_string(threads), {{{"R", "G", "B"}, &floats}, {{"a", "b"}, &ids}});
  }
  Imf::setGlobalThreadCount(before);
  EXPECT_EQ(read_text(folder / "1"), read_text(folder / "0"));
  EXPECT_EQ(read_text(folder / "4"), read_text(folder / "0"));
}

TEST(WriteExr, RejectsMismatchedLayersAndAttributes) {
  const TemporaryFolder folder;
  const auto write = [&](const std::vector<ExrLayer>& layers,
                         const std::vector<ExrAttribute>& attributes = {}) {
    return [&folder, layers, attributes] { write_exr(folder / "a.exr", layers, attributes); };
  };
  const ImageF floats(2, 2, 3), wide(3, 2, 1), empty;
  const Image32 ids(2, 2, 1);
  EXPECT_THAT(write({{{"R", "G"}, &floats}}),
              ThrowsMessage<Error>(HasSubstr("there are 2 names for 3 channels")));
  EXPECT_THAT(write({{{"R", "", "B"}, &floats}, {{"R"}, &ids}}),
              ThrowsMessage<Error>(AllOf(HasSubstr("'' cannot name a channel"),
                                         HasSubstr("two channels are named 'R'"))));
  EXPECT_THAT(write({{{}, &empty}}), ThrowsMessage<Error>(HasSubstr("an image is empty")));
  EXPECT_THAT(write({}), ThrowsMessage<Error>(HasSubstr("there is no image to write")));
  EXPECT_THAT(
      write({{{"id"}, &ids}, {{"Z"}, &wide}}),
      ThrowsMessage<Error>(HasSubstr("images of 2 x 2 and 3 x 2 px cannot be layers of one file")));
  EXPECT_THAT(write({{{"id"}, &ids}}, {{"compression", "none"}, {"", 1.0f}}),
              ThrowsMessage<Error>(AllOf(HasSubstr("attribute 'compression' already exists"),
                                         HasSubstr("'' cannot name an attribute"))));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

TEST(WriteExr, LeavesNoFileWhenTheFileSizeLimitIsExceeded) {
  const TemporaryFolder folder;
  const ImageF floats = odd_floats();
  {
    const FileSizeLimit limit(1000);
    EXPECT_THAT(
        [&] {
          write_exr(folder / "a.exr", {{{"R", "G", "B"}, &floats}});
        },
        ThrowsMessage<Error>(HasSubstr("File too large")));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace groundray::exr_io_test
