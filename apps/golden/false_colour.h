#pragma once

#include <glm/vec2.hpp>
#include <utility>
#include <vector>

#include "core/image/image.h"

namespace groundray::golden {

/// Returns the smallest and the largest finite value; 0 and 1 if there are none. If both are equal,
/// 1 is added to the upper one.
std::pair<double, double> finite_range(const std::vector<double>& values);

/// Paints values, row by row, from violet at `low` to yellow at `high`; non-finite ones are white.
/// Small images are enlarged by a whole factor.
Image8 false_colour(const std::vector<double>& values, glm::ivec2 size_px, double low, double high);

}  // namespace groundray::golden
