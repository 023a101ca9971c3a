#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/geometry/grid_frame.h"
#include "core/io/mesh_io.h"

namespace groundray {

/// One band of a raster.
struct RasterLayer {
  std::string name;               ///< quantity: "elevation"
  std::string unit;               ///< "m"; empty for dimensionless values
  std::span<const float> values;  ///< one per sample of the frame, row by row; NaN for none
};

/// Encoding of the samples in a raster file.
struct RasterForm {
  /// Nodata value. NaN is used if none is set, if float cannot represent it, or if a sample has it.
  std::optional<double> nodata;
  bool is_point = false;  ///< true if samples are points rather than areas: GDAL's AREA_OR_POINT
};

/// Returns the encoding of the samples in a raster file.
/// @throws Error as load_dem if the file is no raster.
RasterForm read_form(const std::filesystem::path& path);

/// Checks that a file can contain the CRS.
/// @throws Error unless the CRS is empty, or one that PROJ knows.
void check_crs(const Georeference& georeference);

/// Writes layers as a cloud-optimised GeoTIFF of float32 bands with lossless DEFLATE compression
/// and overviews. Overviews are means, or single samples if any layer has no unit, because means of
/// counts and flags are meaningless. The file appears only when complete. Samples are at the
/// centres of pixels. The file's rows run from north to south and its columns from west to east,
/// whatever the directions of the frame. load_dem reads such a file if it has one layer or if its
/// first layer is named "elevation": the same values at the same positions, as far as doubles in W
/// represent them.
/// @param georeference  position of D in plan; the height of its origin must be 0. If the CRS
///                      includes heights, the file states them in metres, whatever the CRS's unit
///                      for them.
/// @throws Error that names the file if it cannot be written, or that lists all faults of the
///         layers.
void write_layers(const std::filesystem::path& path, const GridFrame& frame,
                  const Georeference& georeference, std::span<const RasterLayer> layers,
                  const RasterForm& form = {});

/// Writes one layer of bytes, such as flags, as write_layers writes floats; its overviews are
/// single samples.
/// @param name    quantity: "verdict".
/// @param values  one per sample of the frame, row by row.
/// @param nodata  value for none.
/// @throws Error as write_layers.
void write_byte_layer(const std::filesystem::path& path, const GridFrame& frame,
                      const Georeference& georeference, const std::string& name,
                      std::span<const std::uint8_t> values, std::uint8_t nodata);

}  // namespace groundray
