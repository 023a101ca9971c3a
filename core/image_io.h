#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/image.h"

namespace groundray {

/// The most pixels that an image file may have: 16384 x 16384, 1 GiB of 8-bit RGBA.
inline constexpr std::int64_t most_image_pixels = std::int64_t{1} << 28;

/// Reads a PNG or JPEG image as it is stored, with 8 bits a value. What a file says of gamma and
/// colour profile is ignored, as glTF wants it, and so is EXIF's orientation. The pixels are
/// decoded in place: memory is that of the file and of the image.
/// @return 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB, alpha). Palettes are looked up,
///         fewer bits scaled up, 16 bits rounded to 8.
/// @throws Error if the file is missing, no such image, cut short, damaged, of CMYK, or has more
///         than most_image_pixels.
Image8 read_image8(const std::filesystem::path& path);

/// As read_image8, of a file already in memory; `name` stands for it in messages.
Image8 parse_image8(std::string_view bytes, const std::string& name);

/// What the values of a picture stand for: light is not negative.
enum class PictureOf { Light, Heights };

/// Reads a picture of floats: Radiance (.hdr, RGBE) or OpenEXR (R, G, B or Y; of half, float or
/// whole numbers).
/// @return linear values: 1 (Y), 2 (Y, alpha), 3 (RGB) or 4 channels (RGB, alpha); those of a .hdr
///         divided by its EXPOSURE.
/// @throws Error if the file is missing, no such picture, cut short, damaged, has other channels or
///         more than most_image_pixels, or holds a value that is NaN or infinite or, of light,
///         negative; the first such pixel is named.
/// @see Ward, Real pixels, Graphics Gems II (1991).
ImageF read_image_f(const std::filesystem::path& path, PictureOf what = PictureOf::Light);

/// As read_image_f, of a file already in memory; `name` stands for it in messages.
ImageF parse_image_f(std::string_view bytes, const std::string& name,
                     PictureOf what = PictureOf::Light);

/// Reads a picture of heights of any of these kinds, by its bytes: Radiance and OpenEXR as
/// read_image_f, PNG and JPEG as values from 0 to 1: those of PNG with 16 bits in steps of 1/65535,
/// those of fewer bits, palettes and JPEG as read_image8's in steps of 1/255.
/// @throws Error as read_image8 and read_image_f.
ImageF read_heights(const std::filesystem::path& path);

/// As read_heights, of a file already in memory; `name` stands for it in messages.
ImageF parse_heights(std::string_view bytes, const std::string& name);

}  // namespace groundray
