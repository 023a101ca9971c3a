#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Returns the heights with those missing filled by GDALFillNodata (gdal_fillnodata.py), to compare
/// with: weighted by inverse distance from what lies in eight directions.
/// @param size            columns and rows.
/// @param heights_m       row by row; NaN where there is none.
/// @param farthest_cells  how far it looks, at least 1; what has no data so near stays NaN.
/// @throws Error if the sizes disagree or GDAL fails.
std::vector<float> fill_by_gdal(glm::ivec2 size, std::span<const float> heights_m,
                                double farthest_cells);

}  // namespace groundray
