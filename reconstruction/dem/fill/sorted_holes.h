#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "reconstruction/dem/fill/dem_fill.h"

// Selection of the holes of a raster to fill, private to this library.
namespace groundray {

/// Returns 1 for each sample in the convex hull, including its boundary, of the samples with data,
/// else 0.
std::vector<std::uint8_t> inside_hull(glm::ivec2 size, std::span<const std::uint8_t> has_data);

/// Holes of a raster, and the samples to fill.
struct SortedHoles {
  std::vector<RasterHole> holes;                    ///< in the order of their first samples
  std::vector<std::vector<std::uint32_t>> samples;  ///< samples of each hole, ascending
  std::vector<std::int32_t> numbers;  ///< of each sample: index of its hole if that is to be
                                      ///< filled, else known_sample or absent_sample
};

/// Finds the holes of a raster, and selects those to fill.
/// @param has_data  0 or 1 for each sample.
/// @param to_data_m  distance of each sample to data.
SortedHoles sort_holes(const GridFrame& frame, std::span<const std::uint8_t> has_data,
                       std::span<const float> to_data_m, const FillOptions& options);

}  // namespace groundray
