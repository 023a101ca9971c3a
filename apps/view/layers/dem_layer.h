#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "apps/view/rendering/layer.h"
#include "terrain/dem/dem_io.h"

namespace groundray {

/// Returns the options with which the viewer reads a DEM, for display and for comparison: a DEM in
/// geographic coordinates is warped to its UTM zone.
/// @throws Error as inspect_raster.
DemOptions options_for(const std::filesystem::path& dem);

/// Returns the layer of a DEM in projected coordinates, with its first 32 bands. Each sample is a
/// point, or each k-th sample of rows and columns if there are more than `most_samples`; triangles
/// that touch a hole are omitted. Point columns: "height" and, by their names, the other bands;
/// cell column: "slope".
/// @throws Error as load_dem and read_bands; or if no triangle remains.
Layer dem_layer(const std::string& name, const std::filesystem::path& path,
                std::size_t most_samples);

}  // namespace groundray
