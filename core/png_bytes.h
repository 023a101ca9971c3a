#pragma once

#include <string>

#include "core/image.h"

namespace groundray {

/// Returns the PNG file of an image of 1, 3 or 4 channels, of 8 bits a value: grey, RGB, or RGB and
/// alpha. @param name  stands for the file in messages. @throws Error for other channel counts.
std::string png_bytes(const Image8& image, const std::string& name);

/// As above, of 16 bits a value: numbers, of which the file does not say what colours they are.
std::string png_bytes(const Image16& image, const std::string& name);

}  // namespace groundray
