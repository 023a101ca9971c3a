#pragma once

#include <filesystem>
#include <string>

#include "core/image/image.h"

namespace groundray {

/// Returns the PNG file of an image of 1, 3 or 4 channels with 8 bits per value: grey, RGB or RGBA.
/// @param name  file name in error messages.
/// @throws Error for other numbers of channels.
std::string png_bytes(const Image8& image, const std::string& name);

/// Returns a PNG file as above with 16 bits per value. The values are plain numbers: the file
/// states no colour space.
std::string png_bytes(const Image16& image, const std::string& name);

/// Writes an image of 1, 3 or 4 channels as an 8-bit PNG: grey, RGB or RGBA.
/// @throws Error as write_whole, or for other numbers of channels.
void write_png(const std::filesystem::path& path, const Image8& image);

/// Writes an image as above with 16 bits per value. The values are plain numbers: the file states
/// no colour space.
/// @throws Error likewise.
void write_png(const std::filesystem::path& path, const Image16& image);

}  // namespace groundray
