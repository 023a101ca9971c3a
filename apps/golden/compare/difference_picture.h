#pragma once

#include <string>

#include "apps/golden/compare/image_layer.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Adds pictures of both layers, by one scale, and of the `differences` (of one channel; NaN where
/// there is none), from blue for less to red for more. Those of large images show every n-th pixel,
/// of differences the largest. Captions tell the scales. Of equal layers there is one picture.
void draw_layers(const ImageLayer& reference, const ImageLayer& other,
                 const Image<double>& differences, const std::string& unit, Section& into);

/// Adds a picture of `differences` alone, under a caption, to which it adds the scale.
void draw_differences(const std::string& caption, const Image<double>& differences,
                      const std::string& unit, Section& into);

}  // namespace groundray::golden
