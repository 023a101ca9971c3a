#pragma once

#include <string>

#include "apps/golden/compare/images/image_layer.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Adds pictures of both layers on a common scale, and of their differences from blue (negative) to
/// red (positive); a single picture if the layers are equal. Large images are reduced: layers by
/// subsampling, differences to the one of largest magnitude. Captions state the scales.
/// @param differences  one channel; NaN where either layer has no value.
/// @param unit  unit with a leading blank, such as " m"; may be empty.
void draw_layers(const ImageLayer& reference, const ImageLayer& other,
                 const Image<double>& differences, const std::string& unit, Section& into);

/// Adds a picture of `differences` alone; the scale is appended to `caption`.
void draw_differences(const std::string& caption, const Image<double>& differences,
                      const std::string& unit, Section& into);

}  // namespace groundray::golden
