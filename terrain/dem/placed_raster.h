#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem/dem_raster.h"

// Private to the library: rasters that are laid on the ground, brought into W.
namespace groundray {

/// Values of a raster of one band in W, row by row; NaN where there is none.
struct PlacedRaster {
  glm::ivec2 size{0};         ///< columns and rows of pixels
  glm::dvec2 corner_w_m{0};   ///< outer corner of pixel (0, 0), in W
  glm::dvec2 step_m{1};       ///< offset from one pixel to the next; may be negative
  bool is_warped = false;     ///< true if the pixels differ from the file's
  std::vector<float> values;  ///< after scale and offset; units are ignored
};

/// Loads a raster, warped bilinearly if its CRS is not W's; one without a CRS is assumed to be in
/// W.
/// @param nodata   stored value for "no value", besides the declared one.
/// @param crs_wkt  CRS of W, as in Dem.
/// @throws Error as load_dem, or for more than `most_pixels`.
PlacedRaster load_placed_raster(const std::filesystem::path& path, std::optional<double> nodata,
                                const std::string& crs_wkt, std::int64_t most_pixels);

/// Returns the horizontal CRS of W if a raster has to be brought into it; nothing if one of the two
/// has no CRS, or if both have the same local one.
/// @param raster  horizontal CRS of the raster.
/// @throws Error if there is no transformation from one to the other.
std::optional<OGRSpatialReference> crs_to_reach(const OGRSpatialReference& raster,
                                                const std::string& crs_wkt);

/// Removes the vertical part of a CRS.
void flatten(OGRSpatialReference& crs);

/// Checks the number of pixels of a raster.
/// @param source  columns and rows of the file.
/// @param result  columns and rows in W.
/// @throws Error if `result` has more than `most_pixels`, with the command that scales the file
///         down.
void check_pixels(const std::filesystem::path& path, glm::ivec2 source, glm::ivec2 result,
                  std::int64_t most_pixels);

}  // namespace groundray
