#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "core/drape.h"

namespace groundray {

/// What a mask's file does not say of itself.
struct MaskOptions {
  double full = 1;               ///< the value that means "all", scale and offset done
  std::optional<double> nodata;  ///< a stored value that means "none", besides the declared one
  std::string crs_wkt;           ///< W's, as in Dem; empty: the file lies in W
  glm::dvec3 origin_w_m{0};      ///< D's origin in W, as in Dem
};

/// Loads a raster of one band through GDAL as shares from 0 to 1 of what it is a mask of. Its
/// band's scale and offset are honoured. Where it has no value (nodata, NaN, mask, alpha) the share
/// is 0. One in another CRS than W's is warped there, bilinearly; one that names none lies in W.
/// @return an image of one channel, linear.
/// @throws Error that names the file, as load_dem for files that are no such raster or not placed,
///         and for more than most_image_pixels or a value that is not from 0 to `full` (to 1e-5 of
///         it, as scales are written with six digits); the first such pixel is named.
Drape load_mask(const std::filesystem::path& path, const MaskOptions& options);

/// What a photo's file does not say of itself.
struct OrthophotoOptions {
  std::string crs_wkt;       ///< as in MaskOptions
  glm::dvec3 origin_w_m{0};  ///< as in MaskOptions
};

/// Loads a photo of the ground through GDAL: bands of bytes, grey or RGB or a palette of colours,
/// with or without alpha; sRGB. A pixel has no data where alpha is 0, a mask hides it, or all its
/// bands have their nodata value.
///
/// One in another CRS than W's, or rotated, is warped, its stored values bilinearly, to square
/// pixels of the size that GDAL suggests (about the same); what lies beyond it has no data, and
/// positions are off by 1 % of a pixel at most. One that names no CRS lies in W.
/// @return an image of 1 (grey) or 3 channels, and one of alpha if a pixel is not opaque. Alpha is
/// 0
///         where there are no data; the colour there is that of the nearest block of 2^k x 2^k
///         pixels that has some, so that lookups next to it are not darkened.
/// @throws Error that names the file: as load_dem for files that are missing, no raster, cut short
///         or not placed; and for other bands, wider values than bytes, no data at all, or more
///         than most_image_pixels, with the command that mends it.
Drape load_orthophoto(const std::filesystem::path& path, const OrthophotoOptions& options);

}  // namespace groundray
