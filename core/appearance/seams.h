#pragma once

#include <string>

#include "core/image/image.h"

namespace groundray {

/// Checks that an image repeats without visible seams: that its first and last rows, and its first
/// and last columns, differ by at most 1.5 times as much (root mean square) as those two
/// neighbouring rows or columns inside that differ most. The limit is our choice.
/// @param name  file name in the message.
/// @throws Error stating the edges and both differences, in steps of 8 bits.
void require_seamless(const Image8& image, const std::string& name);

}  // namespace groundray
