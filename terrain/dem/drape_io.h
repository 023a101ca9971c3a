#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "core/appearance/ground_cover.h"

namespace groundray {

/// Options of a mask that its file does not contain.
struct MaskOptions {
  double full = 1;               ///< value that represents the fraction 1, after scale and offset
  std::optional<double> nodata;  ///< stored value for "no value", besides the declared one
  std::string crs_wkt;           ///< CRS of W, as in Dem; empty: the file is in W
  glm::dvec3 origin_w_m{0};      ///< D's origin in W, as in Dem
};

/// Loads a raster of one band through GDAL as fractions from 0 to 1 of the masked quantity. The
/// band's scale and offset are applied. The fraction is 0 where there is no value (nodata, NaN,
/// mask, alpha). A raster in another CRS than W's is warped to it, bilinearly; one without a CRS is
/// assumed to be in W.
/// @return an image of one channel, linear.
/// @throws Error that names the file, as load_dem for files that are no such raster or not
///         georeferenced, and for more than most_image_pixels or a value outside 0 to `full` (by
///         more than 1e-5 of it, because scales are written with six digits); the first such pixel
///         is named.
Drape load_mask(const std::filesystem::path& path, const MaskOptions& options);

/// Options of a photo that its file does not contain.
struct OrthophotoOptions {
  std::string crs_wkt;       ///< as in MaskOptions
  glm::dvec3 origin_w_m{0};  ///< as in MaskOptions
};

/// Loads a photo of the ground through GDAL: bands of bytes, grey or RGB or a colour palette, with
/// or without alpha; sRGB. A pixel has no data where alpha is 0, where a mask hides it, or where
/// all its bands have their nodata value.
///
/// A photo in another CRS than W's, or rotated, is warped to square pixels of the size that GDAL
/// suggests (about the same). Stored values are interpolated bilinearly, and positions are off by
/// at most 1 % of a pixel. Areas beyond the photo have no data. A photo without a CRS is assumed to
/// be in W.
/// @return an image of 1 (grey) or 3 channels, and one of alpha if any pixel is not opaque. Alpha
///         is 0 where there are no data. The colour there is the mean of the smallest aligned block
///         of 2^k x 2^k pixels that contains data, so that lookups beside it are not darkened.
/// @throws Error that names the file: as load_dem for files that are missing, no raster, truncated
///         or not georeferenced; and for other bands, values wider than bytes, no data at all, or
///         more than most_image_pixels. The message contains the command that converts the file, if
///         there is one.
Drape load_orthophoto(const std::filesystem::path& path, const OrthophotoOptions& options);

}  // namespace groundray
