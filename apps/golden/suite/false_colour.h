#pragma once

#include <glm/vec2.hpp>
#include <utility>
#include <vector>

#include "core/image.h"

namespace groundray::golden {

/// The smallest and the largest finite value; 0 and 1 if there is none, and never equal.
std::pair<double, double> finite_range(const std::vector<double>& values);

/// Paints values, row by row, from violet at `low` to yellow at `high`; those not finite are white.
/// Small images are enlarged by whole pixels.
Image8 false_colour(const std::vector<double>& values, glm::ivec2 size_px, double low, double high);

}  // namespace groundray::golden
