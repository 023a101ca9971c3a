#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "apps/view/layer.h"

namespace groundray {

/// Returns the layer of a DEM file with all its bands: each sample a point, or each k-th if there
/// are more than `most_samples`; cells with a void are cut out. Columns "height" and, by their
/// names, those of the other bands; of cells "slope".
/// @throws Error as load_dem and read_bands; or if all samples are voids.
Layer dem_layer(const std::string& name, const std::filesystem::path& path,
                std::size_t most_samples);

}  // namespace groundray
