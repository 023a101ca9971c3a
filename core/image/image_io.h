#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/image/image.h"

namespace groundray {

/// Greatest number of pixels of an image file: 16384 x 16384, 1 GiB of 8-bit RGBA.
inline constexpr std::int64_t most_image_pixels = std::int64_t{1} << 28;

/// Reads a PNG or JPEG image as stored, with 8 bits per value. Gamma and colour profiles are
/// ignored, as glTF requires, and so is the EXIF orientation. Pixels are decoded in place: memory
/// is that of the file and of the image.
/// @return 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB, alpha). Palettes are expanded,
///         fewer bits scaled up, 16 bits rounded to 8.
/// @throws Error if the file is missing, not such an image, truncated, damaged, CMYK, or has more
///         pixels than most_image_pixels or the available memory allows.
Image8 read_image8(const std::filesystem::path& path);

/// Decodes a file in memory as read_image8 does; `name` identifies it in messages.
Image8 parse_image8(std::string_view bytes, const std::string& name,
                    std::int64_t most_pixels = most_image_pixels);

/// Quantity in a float image; light must not be negative.
enum class PictureOf { Light, Heights };

/// Reads an image of floats: Radiance (.hdr, RGBE) or OpenEXR (R, G, B or Y; half, float or
/// integer).
/// @return linear values: 1 (Y), 2 (Y, alpha), 3 (RGB) or 4 channels (RGB, alpha); those of a .hdr
///         divided by its EXPOSURE and COLORCORR.
/// @throws Error if the file is missing, not such an image, truncated, damaged, has other channels
///         or more than most_image_pixels, or contains a value that is NaN, infinite or, for light,
///         negative; the message states the first such pixel.
/// @see Ward, Real pixels, Graphics Gems II (1991).
ImageF read_image_f(const std::filesystem::path& path, PictureOf what = PictureOf::Light);

/// Decodes a file in memory as read_image_f does; `name` identifies it in messages.
ImageF parse_image_f(std::string_view bytes, const std::string& name,
                     PictureOf what = PictureOf::Light,
                     std::int64_t most_pixels = most_image_pixels);

/// Reads heights from an image of any of these formats, detected by its content. Radiance and
/// OpenEXR are read as by read_image_f. PNG and JPEG give values from 0 to 1: PNG of 16 bits in
/// steps of 1/65535; fewer bits, palettes and JPEG, as by read_image8, in steps of 1/255.
/// @throws Error as read_image8 and read_image_f.
ImageF read_heights(const std::filesystem::path& path);

/// Decodes a file in memory as read_heights does; `name` identifies it in messages.
ImageF parse_heights(std::string_view bytes, const std::string& name,
                     std::int64_t most_pixels = most_image_pixels);

}  // namespace groundray
