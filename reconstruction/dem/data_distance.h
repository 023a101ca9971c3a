#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Returns the distance in plan of each sample of a raster to the nearest sample with data, m: 0 at
/// samples with data, infinite if there are none. Exact except for rounding, for any ratio of the
/// cells' sides. The time is proportional to the number of samples.
/// @param size  columns and rows.
/// @param step_m  step from one sample to the next; components may be negative.
/// @param has_data  0 or 1 for each sample, in row order.
/// @throws Error if the raster is empty, the sizes disagree, or a step is zero or not finite.
/// @see Felzenszwalb, Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8
///      (2012).
std::vector<float> data_distance_m(glm::ivec2 size, glm::dvec2 step_m,
                                   std::span<const std::uint8_t> has_data);

}  // namespace groundray
