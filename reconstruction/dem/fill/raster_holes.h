#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

// Samples of a raster without heights, private to this library.
namespace groundray {

/// Returns the sets of wanted samples that are connected through neighbours, eight for each:
/// numbers of samples, ascending; sets in the order of their first samples.
/// @param is_wanted  0 or 1 for each sample of the raster.
std::vector<std::vector<std::uint32_t>> linked_samples(glm::ivec2 size,
                                                       std::span<const std::uint8_t> is_wanted);

/// Returns 1 for each sample in the convex hull, including its boundary, of the samples with data,
/// else 0.
std::vector<std::uint8_t> inside_hull(glm::ivec2 size, std::span<const std::uint8_t> has_data);

}  // namespace groundray
