#pragma once

#include <filesystem>
#include <vector>

#include "core/image.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// What the colours of a picture's third panel stand for.
struct PictureScale {
  double most_m = 0;  ///< the error, or the standard deviation, that has the fullest colour
};

/// Draws a DEM for people, panels side by side, north up: a hillshade of what was measured, holes
/// dark; the same with what was filled in, which is orange; and the error, red where the DEM is too
/// high and blue where it is too low, or without it the stated standard deviation (yellow is small,
/// violet large). `scale` is set so that 95 % are within it.
/// @param error_m  of each sample; or empty.
Image8 draw_dem(const DemLayers& layers, const std::vector<float>& error_m, PictureScale& scale);

}  // namespace groundray
