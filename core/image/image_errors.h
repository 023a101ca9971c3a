#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/memory.h"

namespace groundray {

// First bytes of float images.
inline constexpr std::string_view hdr_magic = "#?";
inline constexpr std::string_view exr_magic = "\x76\x2f\x31\x01";

inline bool is_image_f(std::string_view bytes) {
  return bytes.starts_with(hdr_magic) || bytes.starts_with(exr_magic);
}

[[noreturn]] inline void throw_damaged(const std::string& name, std::string_view format,
                                       std::string_view fault) {
  throw Error("{}: it is truncated or damaged: {} ({}); copy or save it again", name, fault,
              format);
}

inline void check_size(const std::string& name, std::int64_t width, std::int64_t height,
                       std::int64_t most_pixels = most_image_pixels) {
  if (width > 0 && height > 0 && width <= most_pixels / height) return;
  throw Error(
      "{}: it has {} x {} pixels; it must have at least one and at most {} ({} x {}): scale it "
      "down or split it",
      name, width, height, most_pixels, std::sqrt(most_pixels), std::sqrt(most_pixels));
}

/// Checks the memory of a decoded image.
inline void require_image_memory(const std::string& name, std::int64_t width, std::int64_t height,
                                 std::size_t bytes_per_pixel) {
  require_memory(name, fmt::format("its {} x {} pixels", width, height),
                 static_cast<double>(width) * static_cast<double>(height) *
                     static_cast<double>(bytes_per_pixel));
}

/// Decodes the colours of an OpenEXR file in memory; see read_image_f.
ImageF parse_exr_picture(std::string_view bytes, const std::string& name, std::int64_t most_pixels);

}  // namespace groundray
