#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "apps/view/layer.h"
#include "terrain/dem_io.h"

namespace groundray {

/// Returns how a DEM file is read wherever it is shown or measured against: one that is placed by
/// angles is warped to its UTM zone. @throws Error as inspect_raster.
DemOptions options_for(const std::filesystem::path& dem);

/// Returns the layer of a DEM file that is placed by metres, with all its bands, or its first 32:
/// each sample a point, or each k-th if there are more than `most_samples`; cells with a void are
/// cut out. Columns "height" and, by their names, those of the other bands; of cells "slope".
/// @throws Error as load_dem and read_bands; or if all samples are voids.
Layer dem_layer(const std::string& name, const std::filesystem::path& path,
                std::size_t most_samples);

}  // namespace groundray
