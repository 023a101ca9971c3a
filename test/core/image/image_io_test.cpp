#include "core/image/image_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/png_io.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"
// libjpeg's header requires <cstdio>.
#include <jpeglib.h>

namespace groundray::image_io_test {
namespace {

using namespace std::string_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

std::string from_hex(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  }
  return bytes;
}

Image8 noise(int width, int height, int channels) {
  std::mt19937 generator(1);
  Image8 image(width, height, channels);
  for (std::uint8_t& value : image.values()) value = static_cast<std::uint8_t>(generator() >> 24);
  return image;
}

std::string png_bytes(const Image8& image) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", image);
  return read_text(folder / "a.png");
}

std::string exr_bytes(const ImageF& image, const std::vector<std::string>& channels) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", {{channels, &image}});
  return read_text(folder / "a.exr");
}

std::string jpeg_bytes(const Image8& image, J_COLOR_SPACE space) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr faults{};
  jpeg.err = jpeg_std_error(&faults);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(image.width());
  jpeg.image_height = static_cast<JDIMENSION>(image.height());
  jpeg.input_components = image.channels();
  jpeg.in_color_space = space;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 100, TRUE);
  jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = 1;  // no chroma subsampling
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < image.height(); ++y) {
    auto* row = const_cast<JSAMPROW>(image.at(0, y).data());
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::string result(reinterpret_cast<const char*>(bytes), size);
  jpeg_destroy_compress(&jpeg);
  std::free(bytes);
  return result;
}

Image8 ramps(int channels) {
  Image8 image(24, 16, channels);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 24; ++x) {
      const std::array values{10 * x, 15 * y, 100, 0};
      for (std::size_t i = 0; i < image.at(x, y).size(); ++i) {
        image.at(x, y)[i] = static_cast<std::uint8_t>(values[i]);
      }
    }
  }
  return image;
}

std::string hdr_bytes(const std::string& lines, int width, int height, const std::string& pixels) {
  return "#?RADIANCE\n# a comment\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n-Y " +
         std::to_string(height) + " +X " + std::to_string(width) + "\n" + pixels;
}

TEST(ReadImage8, ReadsBackWrittenPng) {
  const TemporaryFolder folder;
  for (const int channels : {1, 3, 4}) {
    const Image8 image = noise(13, 7, channels);
    write_png(folder / "a.png", image);
    const Image8 read = read_image8(folder / "a.png");
    EXPECT_EQ(read.width(), 13);
    EXPECT_EQ(read.height(), 7);
    EXPECT_EQ(read.channels(), channels);
    EXPECT_THAT(read.values(), ElementsAreArray(image.values()));
  }
}

// Files and values were made with Pillow 12.
TEST(ReadImage8, ReadsEveryKindOfPng) {
  const std::string grey_alpha = from_hex(
      "89504e470d0a1a0a0000000d49484452000000020000000108040000005e2bb7010000000d49444154789c63e412"
      "d9170000023a012e43cf427f0000000049454e44ae426082");
  EXPECT_THAT(parse_image8(grey_alpha, "a").values(), ElementsAre(10, 20, 200, 100));
  EXPECT_EQ(parse_image8(grey_alpha, "a").channels(), 2);
  const std::string palette = from_hex(
      "89504e470d0a1a0a0000000d4948445200000003000000010203000000668efc2700000009504c5445ff00000080"
      "00010203d1370c160000000374524e53ff07ff26ad89790000000a49444154789c6368010000860085bcf5cdd600"
      "00000049454e44ae426082");
  EXPECT_THAT(parse_image8(palette, "a").values(),
              ElementsAre(1, 2, 3, 255, 255, 0, 0, 255, 0, 128, 0, 7));
  const std::string one_bit = from_hex(
      "89504e470d0a1a0a0000000d4948445200000003000000010100000000339b29190000000a49444154789c635800"
      "0000a200a1dc8db1cc0000000049454e44ae426082");
  EXPECT_THAT(parse_image8(one_bit, "a").values(), ElementsAre(255, 0, 255));
  const std::string sixteen_bits = from_hex(
      "89504e470d0a1a0a0000000d49484452000000050000000110000000006305e76c0000001349444154789c636060"
      "60686068fcff3f2505000e3503c888e6c3e90000000049454e44ae426082");
  // 0, 128, 129, 65535 and 25700 of 65535, rounded to the nearest of 255.
  EXPECT_THAT(parse_image8(sixteen_bits, "a").values(), ElementsAre(0, 0, 1, 255, 100));
}

// At quality 100 the coefficients of the orthonormal transform are rounded to integers, then the
// values are: a standard deviation of 0.41 for luma and chroma, and of 0.41 hypot(1, 1.772) = 0.83
// for blue.
TEST(ReadImage8, ReadsJpeg) {
  for (const int channels : {1, 3}) {
    const Image8 image = ramps(channels);
    const std::string bytes = jpeg_bytes(image, channels == 1 ? JCS_GRAYSCALE : JCS_RGB);
    const Image8 read = parse_image8(bytes, "a.jpg");
    ASSERT_EQ(read.channels(), channels);
    ASSERT_EQ(read.values().size(), image.values().size());
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      EXPECT_NEAR(read.values()[i], image.values()[i], 5 * (channels == 1 ? 0.41 : 0.83)) << i;
    }
  }
}

TEST(ReadImage8, ReportsWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  const auto message = [](const std::string& bytes) {
    return message_of([&] { parse_image8(bytes, "a.png"); });
  };
  EXPECT_THAT(message_of([&] { read_image8(folder / "no.png"); }),
              HasSubstr("no.png: there is no such file"));
  EXPECT_THAT(message_of([&] { read_image8(folder.path()); }),
              HasSubstr("it is a folder, but must be a file"));
  EXPECT_THAT(message(""), HasSubstr("a.png: it is neither a PNG nor a JPEG image: it is empty"));
  EXPECT_THAT(message("GIF89a"), HasSubstr("despite its name: convert it"));
  EXPECT_THAT(message(jpeg_bytes(ramps(4), JCS_CMYK)), HasSubstr("CMYK"));
}

TEST(ReadImage8, RejectsEmptyAndOversizedImagesBeforeAllocating) {
  std::string png = png_bytes(noise(4, 4, 4));
  const auto sized = [&png](const std::string& width, const std::string& height) {
    std::string bytes = png;  // the header's data begin at 16, its checksum covers 12 to 29
    bytes.replace(16, 8, width + height);
    const auto* const header = reinterpret_cast<const Bytef*>(bytes.data() + 12);
    const auto sum = static_cast<std::uint32_t>(crc32(0, header, 17));
    for (std::size_t i = 0; i < 4; ++i) bytes[29 + i] = static_cast<char>(sum >> (24 - 8 * i));
    return message_of([&] { parse_image8(bytes, "a.png"); });
  };
  EXPECT_THAT(sized("\0\0\x40\x01"s, "\0\0\x40\0"s),
              HasSubstr("a.png: it has 16385 x 16384 pixels; it must have at least one and at most "
                        "268435456 (16384 x 16384)"));
  EXPECT_THAT(sized("\x7f\xff\xff\xff"s, "\x7f\xff\xff\xff"s),
              HasSubstr("2147483647 x 2147483647"));
  EXPECT_THAT(sized("\0\0\0\0"s, "\0\0\0\x04"s), HasSubstr("a.png: it is truncated or damaged"));
  std::string jpeg = jpeg_bytes(ramps(1), JCS_GRAYSCALE);
  const std::size_t frame = jpeg.find("\xff\xc0"s);
  jpeg.replace(frame + 5, 4, "\x40\x01\x40\x01"s);
  EXPECT_THAT(message_of([&] { parse_image8(jpeg, "a.jpg"); }), HasSubstr("16385 x 16385 pixels"));
}

TEST(ReadImageF, ReadsBackWrittenExr) {
  const TemporaryFolder folder;
  const std::vector<std::vector<std::string>> kinds{
      {"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
  for (const auto& channels : kinds) {
    ImageF image(9, 5, static_cast<int>(channels.size()));
    float value = 0;
    for (float& v : image.values()) v = value += 0.37f;
    write_exr(folder / "a.exr", {{channels, &image}});
    const ImageF read = read_image_f(folder / "a.exr");
    EXPECT_EQ(read.channels(), image.channels());
    EXPECT_EQ(read.width(), 9);
    EXPECT_THAT(read.values(), ElementsAreArray(image.values()));
  }
}

// RGBE: (128, 64, 32) times 2^(129 - 136) is (1, 0.5, 0.25); an exponent of 0 is black.
TEST(ReadImageF, ReadsUncompressedRadiancePixelsAndRepeats) {
  const std::string pixels = "\x80\x40\x20\x81"s + "\x01\x01\x01\x02"s + "\x80\x40\x20\0"s;
  const ImageF image = parse_image_f(hdr_bytes("", 4, 1, pixels), "a.hdr");
  EXPECT_THAT(image.values(), ElementsAre(1, 0.5, 0.25, 1, 0.5, 0.25, 1, 0.5, 0.25, 0, 0, 0));
}

TEST(ReadImageF, ReadsRunLengthEncodedRadianceRows) {
  const std::string row =
      "\x02\x02\0\x08"s        // a row of 8 pixels, channel by channel:
      "\x88\x80"s              // red 8 times 128
      "\x04\x10\x20\x30\x40"s  // green 4 values, then 4 times 80
      "\x84\x50"s
      "\x88\0"s     // blue 8 times 0
      "\x88\x81"s;  // exponent 8 times 129
  const ImageF image = parse_image_f(hdr_bytes("", 8, 2, row + row), "a.hdr");
  const std::array green{0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.625f, 0.625f, 0.625f};
  for (int i = 0; i < 16; ++i) {
    EXPECT_THAT(image.at(i % 8, i / 8), ElementsAre(1, green[static_cast<std::size_t>(i % 8)], 0));
  }
}

TEST(ReadImageF, DividesRadianceByItsExposures) {
  const std::string bytes =
      hdr_bytes("EXPOSURE=2\nEXPOSURE= 4\nCOLORCORR=1 0.5 1\n", 1, 1, "\x80\x40\x20\x81"s);
  EXPECT_THAT(parse_image_f(bytes, "a.hdr").values(), ElementsAre(0.125, 0.125, 0.03125));
}

TEST(ReadImageF, NamesTheFirstPixelWithInvalidLight) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -0.25f}) {
    ImageF image(5, 4, 3);
    image.at(3, 2)[1] = bad;
    image.at(4, 3)[0] = bad;
    const std::string bytes = exr_bytes(image, {"R", "G", "B"});
    EXPECT_THAT(message_of([&] { parse_image_f(bytes, "sky.exr"); }),
                AllOf(HasSubstr("sky.exr: channel 1 of the pixel in column 3, row 2 (from 0, the "
                                "top) is "),
                      HasSubstr("light must be finite and not negative")));
    const std::string of_heights =
        message_of([&] { parse_image_f(bytes, "relief.exr", PictureOf::Heights); });
    EXPECT_EQ(of_heights.find("heights must be finite") == std::string::npos, bad == -0.25f);
  }
  const std::string bright = hdr_bytes("EXPOSURE=1e-30\n", 1, 1, "\x80\x40\x20\xff"s);
  EXPECT_THAT(message_of([&] { parse_image_f(bright, "sky.hdr"); }),
              HasSubstr("column 0, row 0 (from 0, the top) is inf"));
}

TEST(ReadImageF, ReportsWhatIsWrongWithAFile) {
  const auto message = [](const std::string& bytes) {
    return message_of([&] { parse_image_f(bytes, "sky.hdr"); });
  };
  EXPECT_THAT(message(""), HasSubstr("sky.hdr: it is neither a Radiance (.hdr) nor an OpenEXR"));
  EXPECT_THAT(message(png_bytes(noise(2, 2, 3))), HasSubstr("despite its name"));
  EXPECT_THAT(
      message(exr_bytes(ImageF(2, 2, 2), {"Z", "R"})),
      HasSubstr("its channels are R, Z; it must have R, G and B, or Y, at full resolution"));
  EXPECT_THAT(message("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n"),
              HasSubstr("FORMAT = \"32-bit_rle_xyze\" must be 32-bit_rle_rgbe"));
  EXPECT_THAT(message("#?RADIANCE\n\n+Y 1 +X 1\n"),
              HasSubstr("its size line \"+Y 1 +X 1\" must be -Y HEIGHT +X WIDTH"));
  EXPECT_THAT(message(hdr_bytes("", 16385, 16384, "")), HasSubstr("16385 x 16384 pixels"));
  EXPECT_THAT(message(hdr_bytes("", 0, 4, "")), HasSubstr("0 x 4 pixels"));
  EXPECT_THAT(message(hdr_bytes("EXPOSURE=0\n", 1, 1, "")), HasSubstr("must be positive"));
  EXPECT_THAT(message(hdr_bytes("", 2, 1, "\x01\x01\x01\x05"s)),
              HasSubstr("a run beyond the end of its row"));
  EXPECT_THAT(message(hdr_bytes("", 8, 1, "\x02\x02\0\x09"s)), HasSubstr("a row of wrong length"));
}

// Bytes of a PNG with 16 bits per value, written by libpng; values row by row.
std::string png16_bytes(int width, int color_type, std::vector<std::uint16_t> values) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  const auto append = [](png_structp to, png_bytep data, std::size_t size) {
    static_cast<std::string*>(png_get_io_ptr(to))->append(reinterpret_cast<char*>(data), size);
  };
  png_set_write_fn(png, &bytes, append, [](png_structp) {});
  const std::size_t in_row =
      static_cast<std::size_t>(width) * (color_type == PNG_COLOR_TYPE_RGB ? 3 : 1);
  const std::size_t height = values.size() / in_row;
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 16,
               color_type, PNG_INTERLACE_ADAM7, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
  png_write_info(png, info);
  for (std::uint16_t& v : values) v = static_cast<std::uint16_t>(v << 8 | v >> 8);  // big-endian
  std::vector<png_bytep> rows;
  for (std::size_t y = 0; y < height; ++y) {
    rows.push_back(reinterpret_cast<png_bytep>(values.data() + y * in_row));
  }
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

TEST(ReadHeights, KeepsAll16BitsOfAPng) {
  std::vector<std::uint16_t> values;
  for (int i = 0; i < 65536; ++i) values.push_back(static_cast<std::uint16_t>(i));
  const ImageF grey = parse_heights(png16_bytes(256, PNG_COLOR_TYPE_GRAY, values), "a.png");
  ASSERT_EQ(grey.width(), 256);
  ASSERT_EQ(grey.height(), 256);
  ASSERT_EQ(grey.channels(), 1);
  for (int i = 0; i < 65536; ++i) {
    ASSERT_EQ(grey.at(i % 256, i / 256)[0], static_cast<float>(i / 65535.0)) << i;
  }
  const ImageF rgb = parse_heights(
      png16_bytes(2, PNG_COLOR_TYPE_RGB, {1, 256, 65535, 0x1234, 0x8000, 0}), "a.png");
  ASSERT_EQ(rgb.channels(), 3);
  EXPECT_THAT(rgb.values(), ElementsAre(1 / 65535.0f, 256 / 65535.0f, 1, 0x1234 / 65535.0f,
                                        0x8000 / 65535.0f, 0));
}

TEST(ReadHeights, ReadsFewerBitsAsFractionsOf255) {
  const TemporaryFolder folder;
  Image8 image(256, 1, 1);
  for (int i = 0; i < 256; ++i) image.at(i, 0)[0] = static_cast<std::uint8_t>(i);
  write_png(folder / "a.exr", image);  // the format ignores the file name
  const ImageF read = read_heights(folder / "a.exr");
  for (int i = 0; i < 256; ++i) EXPECT_EQ(read.at(i, 0)[0], static_cast<float>(i / 255.0));
  const std::string jpeg = jpeg_bytes(ramps(1), JCS_GRAYSCALE);
  const Image8 bytes = parse_image8(jpeg, "a.jpg");
  const ImageF heights = parse_heights(jpeg, "a.png");
  ASSERT_EQ(heights.values().size(), bytes.values().size());
  for (std::size_t i = 0; i < bytes.values().size(); ++i) {
    EXPECT_EQ(heights.values()[i], static_cast<float>(bytes.values()[i] / 255.0));
  }
}

TEST(ReadHeights, ReadsFloatsUnchanged) {
  ImageF image(2, 1, 1);
  image.at(0, 0)[0] = -12.5f;
  image.at(1, 0)[0] = 1234.5678f;
  EXPECT_THAT(parse_heights(exr_bytes(image, {"Y"}), "a.png").values(),
              ElementsAre(-12.5f, 1234.5678f));
  EXPECT_THAT(parse_heights(hdr_bytes("", 1, 1, "\x80\x40\x20\x81"), "a").values(),
              ElementsAre(1, 0.5, 0.25));
}

TEST(ReadHeights, ReportsWhatIsWrongWithAFile) {
  const auto message = [](const std::string& bytes) {
    return message_of([&] { parse_heights(bytes, "relief.tif"); });
  };
  EXPECT_THAT(message(""), AllOf(HasSubstr("relief.tif: it is not a PNG, JPEG, OpenEXR"),
                                 HasSubstr("it is empty")));
  EXPECT_THAT(message("II*\0"s), HasSubstr("despite its name: convert it"));
  const std::string png = png16_bytes(2, PNG_COLOR_TYPE_GRAY, {1, 2, 3, 4});
  for (std::size_t size = 8; size < png.size(); ++size) {
    EXPECT_THAT(message(png.substr(0, size)), HasSubstr("relief.tif: it is truncated or damaged"));
  }
  ImageF image(1, 1, 1);
  image.at(0, 0)[0] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(message(exr_bytes(image, {"Y"})), HasSubstr("heights must be finite"));
}

// Every prefix of a file is rejected, and reported only by the Error.
TEST(ReadImage, RejectsTruncatedFilesWithoutPrinting) {
  ImageF light(9, 5, 3);
  float value = 0;
  for (float& v : light.values()) v = value += 0.37f;
  const std::vector<std::string> whole{
      png_bytes(noise(9, 5, 4)), jpeg_bytes(ramps(3), JCS_RGB), exr_bytes(light, {"R", "G", "B"}),
      hdr_bytes("", 2, 2, "\x80\x40\x20\x81\x80\x40\x20\x81\x80\x40\x20\x81\x80\x40\x20\x81")};
  ::testing::internal::CaptureStderr();
  for (std::size_t kind = 0; kind < whole.size(); ++kind) {
    const auto parse = [kind](std::string_view bytes) {
      return kind < 2 ? parse_image8(bytes, "a").width() : parse_image_f(bytes, "a").width();
    };
    EXPECT_NO_THROW(parse(whole[kind]));
    for (std::size_t size = 0; size < whole[kind].size(); ++size) {
      EXPECT_THROW(parse(std::string_view(whole[kind]).substr(0, size)), Error) << size;
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(ReadImage, SurvivesDamage) {
  ImageF light(9, 5, 3);
  const std::vector<std::string> whole{png_bytes(noise(9, 5, 4)), jpeg_bytes(ramps(3), JCS_RGB),
                                       exr_bytes(light, {"R", "G", "B"})};
  std::mt19937 generator(2);
  ::testing::internal::CaptureStderr();
  for (std::size_t kind = 0; kind < whole.size(); ++kind) {
    for (int i = 0; i < 300; ++i) {
      std::string bytes = whole[kind];
      bytes[8 + generator() % (bytes.size() - 8)] = static_cast<char>(generator());
      try {
        const int width =
            kind < 2 ? parse_image8(bytes, "a").width() : parse_image_f(bytes, "a").width();
        EXPECT_GT(width, 0);
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("a: "));
      }
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace groundray::image_io_test
