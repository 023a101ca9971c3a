#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

// Where a raster has no heights, private to this library.
namespace groundray {

/// Returns the sets of wanted samples that are linked by neighbours, eight for each: numbers of
/// samples, ascending; sets in the order of their first ones.
/// @param is_wanted  of each sample of the raster: 0 or 1.
std::vector<std::vector<std::uint32_t>> linked_samples(glm::ivec2 size,
                                                       std::span<const std::uint8_t> is_wanted);

/// Returns of each sample whether it lies in the convex hull, its border included, of those that
/// have data: 0 or 1.
std::vector<std::uint8_t> inside_hull(glm::ivec2 size, std::span<const std::uint8_t> has_data);

}  // namespace groundray
