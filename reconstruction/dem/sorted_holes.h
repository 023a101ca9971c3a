#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/dem/dem_fill.h"

// Which holes of a raster are filled, private to this library.
namespace groundray {

/// The holes of a raster, and which samples are to be filled.
struct SortedHoles {
  std::vector<RasterHole> holes;                    ///< in the order of their first samples
  std::vector<std::vector<std::uint32_t>> samples;  ///< of each hole, ascending
  std::vector<std::int32_t> numbers;  ///< of each sample: that of its hole where that is to be
                                      ///< filled, else plate_known or plate_absent
};

/// Finds the holes, and which of them are to be filled.
/// @param has_data   of each sample: 0 or 1.
/// @param to_data_m  of each sample.
SortedHoles sort_holes(const GridFrame& frame, std::span<const std::uint8_t> has_data,
                       std::span<const float> to_data_m, const FillOptions& options);

}  // namespace groundray
