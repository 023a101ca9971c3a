#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/grid_frame.h"
#include "core/mesh_io.h"

namespace groundray {

/// One band of a raster.
struct RasterLayer {
  std::string name;               ///< what it tells: "elevation"
  std::string unit;               ///< "m"; empty for numbers
  std::span<const float> values;  ///< one for each sample of the frame, row by row; NaN for none
};

/// Writes layers as a cloud-optimised GeoTIFF of float32 bands whose nodata is NaN; appears only
/// when whole. Samples stand at the centres of pixels; the file's rows run from north to south and
/// its columns from west to east, whichever way the frame's do. load_dem reads such a file if its
/// first layer's name is "elevation".
/// @param georeference  places D in plan; its origin's height must be 0.
/// @throws Error that names the file if it cannot be written; or listing all that is wrong with the
///         layers.
void write_layers(const std::filesystem::path& path, const GridFrame& frame,
                  const Georeference& georeference, std::span<const RasterLayer> layers);

}  // namespace groundray
