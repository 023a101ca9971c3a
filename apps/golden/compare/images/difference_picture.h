#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/golden/compare/images/image_file.h"
#include "apps/golden/report.h"
#include "core/image/image.h"

namespace groundray::golden {

/// Adds pictures of both layers on a common scale, and of their differences from blue (negative) to
/// red (positive), with colour bars; a single picture if the layers are equal. Large images are
/// reduced: layers by subsampling, differences to the one of largest magnitude.
/// @param differences  one channel; NaN where either layer has no value.
/// @param unit  unit with a leading blank, such as " m"; may be empty.
void draw_layers(const ImageLayer& reference, const ImageLayer& other,
                 const Image<double>& differences, const std::string& unit, Section& into);

/// Adds a picture of `differences` alone.
void draw_differences(const std::string& caption, const Image<double>& differences,
                      const std::string& unit, Section& into);

/// Gives pictures of a layer axes that count the columns and rows of its file.
void add_pixel_axes(const ImageLayer& layer, std::span<Picture> pictures);

/// Returns the smallest and the largest finite value; 0 and 1 if there are none. If both are equal,
/// 1 is added to the upper one.
std::pair<double, double> finite_range(const std::vector<double>& values);

/// Paints values, row by row, from violet at `low` to yellow at `high`; non-finite ones are white.
/// Small images are enlarged by a whole factor.
Image8 false_colour(const std::vector<double>& values, glm::ivec2 size_px, double low, double high);

}  // namespace groundray::golden
