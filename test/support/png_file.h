#pragma once

#include <png.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "core/image/image.h"

namespace groundray::testing {

/// Reads the values of a PNG file with 16 bits per value. @throws std::runtime_error if it is not
/// one.
inline Image16 read_png16(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             std::fclose);
  if (!file) throw std::runtime_error("no such file");
  const auto fail = [](png_structp, png_const_charp fault) { throw std::runtime_error(fault); };
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file.get());
  png_read_png(png, info, PNG_TRANSFORM_SWAP_ENDIAN, nullptr);
  if (png_get_bit_depth(png, info) != 16) throw std::runtime_error("not of 16 bits");
  Image16 image(static_cast<int>(png_get_image_width(png, info)),
                static_cast<int>(png_get_image_height(png, info)), png_get_channels(png, info));
  png_bytepp rows = png_get_rows(png, info);
  for (int y = 0; y < image.height(); ++y) {
    const auto row = reinterpret_cast<const std::uint16_t*>(rows[y]);
    std::copy_n(row, image.width() * image.channels(), image.at(0, y).data());
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return image;
}

}  // namespace groundray::testing
