#pragma once

#include <cstddef>

// Private to this library.
namespace groundray {

/// Largest number of beams in a vendor's calibration file: rings have 16 bits.
inline constexpr std::size_t most_beams = 65536;

}  // namespace groundray
