#pragma once

#include <filesystem>
#include <vector>

#include "core/image/image.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// Colour scale of a picture's third panel.
struct PictureScale {
  double most_m = 0;  ///< error or standard deviation of the most saturated colour, m
};

/// Draws a DEM as panels side by side, north up: a hillshade of the measured samples, with holes
/// dark; the same with filled samples, in orange; and the error, red where the DEM is too high and
/// blue where it is too low. Without errors, the third panel shows the stated standard deviation
/// (yellow is small, violet large). `scale` is set so that 95 % of the values are within it.
/// @param error_m  error of each sample, or empty.
Image8 draw_dem(const DemLayers& layers, const std::vector<float>& error_m, PictureScale& scale);

}  // namespace groundray
