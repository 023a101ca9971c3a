#pragma once

#include <cstddef>

// Private to this library.
namespace groundray {

/// The most beams of a vendor's calibration file: rings have 16 bits.
inline constexpr std::size_t most_beams = 65536;

}  // namespace groundray
