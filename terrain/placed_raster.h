#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem_raster.h"

// How rasters that are laid on the ground come into W, private to this library.
namespace groundray {

/// The values of a raster of one band as they lie in W, row by row; NaN where there is none.
struct PlacedRaster {
  glm::ivec2 size{0};         ///< columns and rows of pixels
  glm::dvec2 corner_w_m{0};   ///< outer corner of pixel (0, 0), in W
  glm::dvec2 step_m{1};       ///< from one pixel to the next; may be negative
  bool is_warped = false;     ///< whether the pixels are other ones than the file's
  std::vector<float> values;  ///< scale and offset done, units ignored
};

/// Loads a raster, warped bilinearly if it is in another CRS than W's; one without CRS lies in W.
/// @param nodata  a stored value that means "none", besides the declared one.
/// @param crs_wkt  W's, as in Dem.
/// @throws Error as load_dem, or for more than `most_pixels`.
PlacedRaster load_placed_raster(const std::filesystem::path& path, std::optional<double> nodata,
                                const std::string& crs_wkt, std::int64_t most_pixels);

/// Returns W's CRS in the plane if a raster is to be seen there: not if one of the two has none, or
/// both have the same local one.
/// @param raster  in the plane.
/// @throws Error if there is no way from one to the other.
std::optional<OGRSpatialReference> crs_to_reach(const OGRSpatialReference& raster,
                                                const std::string& crs_wkt);

/// Takes heights off a CRS.
void flatten(OGRSpatialReference& crs);

/// @param source  columns and rows of the file.
/// @param result  those that it has in W.
/// @throws Error if they are more than `most_pixels`, with the command that scales the file down.
void check_pixels(const std::filesystem::path& path, glm::ivec2 source, glm::ivec2 result,
                  std::int64_t most_pixels);

}  // namespace groundray
