#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>

#include "core/grid_frame.h"

namespace groundray {

/// Where a raster of heights lies, and what its file says besides.
struct DemPlace {
  GridFrame frame;
  glm::dvec3 origin_w_m{0};  ///< D's origin in W, as in Dem
  std::string crs_wkt;       ///< as in Dem
  /// The value for "no height": NaN where none is asked for, or where a height has that value.
  std::optional<double> nodata;
  bool is_point = false;           ///< samples are points rather than areas: GDAL's AREA_OR_POINT
  std::string name = "elevation";  ///< of the band
};

/// Returns what the file of a DEM says beside its heights: its declared nodata value and whether
/// its samples are points; the rest is left to the caller.
/// @throws Error as load_dem for files that are no raster.
DemPlace describe_file(const std::filesystem::path& path);

/// Writes a raster of metres as a cloud optimised GeoTIFF of floats, deflated without loss, with
/// overviews. load_dem reads the same heights in the same frame, bit for bit (steps and places as
/// far as doubles in W tell them).
/// @param values_m  of the frame's samples, row by row; NaN where there is none.
/// @throws Error as write_whole; if sizes disagree; or if rows do not run north to south or columns
///         west to east, which such files cannot tell.
void write_dem(const std::filesystem::path& path, const DemPlace& place,
               std::span<const float> values_m);

}  // namespace groundray
