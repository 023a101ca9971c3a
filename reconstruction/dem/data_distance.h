#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Returns how far each sample of a raster is from the nearest one that has data, metres in plan:
/// 0 for those themselves, infinite where none has any. Exact but for rounding, whatever the cells'
/// sides; takes time in proportion to the samples.
/// @param size      columns and rows.
/// @param step_m    from one sample to the next; a component may be negative.
/// @param has_data  of each sample, row by row: 0 or 1.
/// @throws Error if the sizes disagree, or a step is zero or not finite.
/// @see Felzenszwalb, Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8
///      (2012).
std::vector<float> data_distance_m(glm::ivec2 size, glm::dvec2 step_m,
                                   std::span<const std::uint8_t> has_data);

}  // namespace groundray
