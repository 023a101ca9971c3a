#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Returns the heights with missing ones filled by GDALFillNodata (gdal_fillnodata.py), for
/// comparison: means of the data in eight directions, weighted by inverse distance.
/// @param size            columns and rows.
/// @param heights_m       row by row; NaN where there is none.
/// @param farthest_cells  search distance, at least 1; samples without data within it stay NaN.
/// @throws Error if the sizes disagree or GDAL fails.
std::vector<float> fill_by_gdal(glm::ivec2 size, std::span<const float> heights_m,
                                double farthest_cells);

}  // namespace groundray
