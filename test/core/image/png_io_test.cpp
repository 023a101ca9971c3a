#include "core/image/png_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <iterator>
#include <random>

#include "core/error.h"
#include "test/support/png_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::png_io_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

TEST(WritePng, KeepsEveryPixel) {
  const TemporaryFolder folder;
  std::mt19937 random(1);
  const std::pair<int, png_uint_32> formats[] = {
      {1, PNG_FORMAT_GRAY}, {3, PNG_FORMAT_RGB}, {4, PNG_FORMAT_RGBA}};
  for (const auto& [channels, format] : formats) {
    Image8 image(37, 23, channels);
    for (std::uint8_t& value : image.values()) value = static_cast<std::uint8_t>(random());
    write_png(folder / "a.png", image);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    ASSERT_NE(png_image_begin_read_from_file(&png, (folder / "a.png").c_str()), 0) << png.message;
    EXPECT_EQ(png.width, 37u);
    EXPECT_EQ(png.height, 23u);
    EXPECT_EQ(png.format, format);
    std::vector<std::uint8_t> read(PNG_IMAGE_SIZE(png));
    ASSERT_NE(png_image_finish_read(&png, nullptr, read.data(), 0, nullptr), 0) << png.message;
    EXPECT_TRUE(std::ranges::equal(read, image.values())) << channels << " channels";
  }
}

TEST(WritePng, KeepsEveryPixelOfSixteenBits) {
  const TemporaryFolder folder;
  std::mt19937 random(1);
  for (const int channels : {1, 3, 4}) {
    Image16 image(37, 23, channels);
    for (std::uint16_t& value : image.values()) value = static_cast<std::uint16_t>(random());
    write_png(folder / "a.png", image);
    const Image16 read = testing::read_png16(folder / "a.png");
    EXPECT_EQ(read.width(), 37);
    EXPECT_EQ(read.height(), 23);
    EXPECT_EQ(read.channels(), channels);
    EXPECT_TRUE(std::ranges::equal(read.values(), image.values())) << channels << " channels";
  }
}

TEST(WritePng, RejectsTwoChannels) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of([&] { write_png(folder / "a.png", Image16(2, 2, 2)); }),
              HasSubstr("must have 1, 3 or 4 channels; this one has 2"));
  EXPECT_THAT(message_of([&] { write_png(folder / "a.png", Image16(2, 2, 5)); }),
              HasSubstr("this one has 5"));
  EXPECT_THAT(message_of([&] { write_png(folder / "a.png", Image16()); }),
              HasSubstr("this one has 0"));
  EXPECT_THAT(message_of([&] { write_png(folder / "a.png", Image8(2, 2, 2)); }),
              HasSubstr("must have 1, 3 or 4 channels; this one has 2"));
  EXPECT_THAT(names_in(folder.path()), IsEmpty());
}

}  // namespace
}  // namespace groundray::png_io_test
