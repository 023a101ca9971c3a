#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/grid_frame.h"
#include "core/mesh_io.h"

namespace groundray {

/// One band of a raster.
struct RasterLayer {
  std::string name;               ///< what it tells: "elevation"
  std::string unit;               ///< "m"; empty for numbers
  std::span<const float> values;  ///< one for each sample of the frame, row by row; NaN for none
};

/// How a raster's file tells its samples.
struct RasterForm {
  /// The value for "none": NaN where none is asked for, floats cannot tell it, or a sample has it.
  std::optional<double> nodata;
  bool is_point = false;  ///< samples are points rather than areas: GDAL's AREA_OR_POINT
};

/// Returns how a raster's file tells its samples. @throws Error as load_dem for what is no raster.
RasterForm read_form(const std::filesystem::path& path);

/// @throws Error unless the CRS is empty, or one that a file can tell.
void check_crs(const Georeference& georeference);

/// Writes layers as a cloud-optimised GeoTIFF of float32 bands, deflated without loss, with
/// overviews: means, or single samples if a layer has no unit, for means of counts and flags say
/// nothing. Appears only when whole. Samples stand at the centres of pixels; the file's rows run
/// from north to south and its columns from west to east, whichever way the frame's do. load_dem
/// reads such a file if it has one layer or its first one's name is "elevation": the same values in
/// the same places, as far as doubles in W tell them.
/// @param georeference  places D in plan; its origin's height must be 0. Of a CRS with heights
///                      these are in metres, whatever unit it has for them.
/// @throws Error that names the file if it cannot be written; or listing all that is wrong with the
///         layers.
void write_layers(const std::filesystem::path& path, const GridFrame& frame,
                  const Georeference& georeference, std::span<const RasterLayer> layers,
                  const RasterForm& form = {});

}  // namespace groundray
