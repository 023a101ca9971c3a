#pragma once

// Private to the library's raster readers and writers: the only header that includes GDAL's.
#include <cpl_error.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <array>
#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"

namespace groundray {

/// Grid and CRS of a dataset.
struct RasterHeader {
  glm::ivec2 samples{0};
  std::array<double, 6> geotransform{};  ///< GDAL's convention: refers to the corners of pixels
  OGRSpatialReference crs;

  bool is_rotated() const { return geotransform[2] != 0 || geotransform[4] != 0; }
  bool has_place_on_a_body() const { return !crs.IsEmpty() && !crs.IsLocal(); }
  /// Returns the centre of the raster, in the unit of the CRS.
  glm::dvec2 centre() const;
};

/// Registers the permitted drivers of GDAL, once. Limits GDAL's block cache, by default a fraction
/// of the machine's memory, to 64 MiB unless GDAL_CACHEMAX is set. Call it before any other use of
/// GDAL.
void start_gdal();

/// Opens a dataset of at least one band, by the rules of docs/reference/trust.md.
/// @throws Error if there is none, or a rule is broken.
GDALDatasetUniquePtr open_raster(const std::filesystem::path& path);

/// Returns the grid and CRS of a dataset.
/// @param placing  GDAL command that georeferences a raster by its ground control points, for the
///                 error message.
/// @throws Error if the raster has only ground control points, or if its geotransform is not finite
///         or its cells have no area.
RasterHeader read_header(GDALDataset& dataset, const char* placing = "gdalwarp -ot Float32");

/// Returns the CRS's name for human readers: "NAD83 / UTM zone 15N (EPSG:26915)"; "local (no CRS)".
std::string name_of(const OGRSpatialReference& crs);

/// Returns the CRS with heights in metres above the same datum; unchanged without a vertical part.
OGRSpatialReference with_heights_in_metres(const OGRSpatialReference& crs);

/// Returns the CRS as WKT2:2019 on one line; empty if the CRS is empty.
std::string wkt_of(const OGRSpatialReference& crs);

/// Returns `word`, quoted for a shell if necessary.
std::string shell_word(const std::string& word);

/// Returns the command line that runs one of GDAL's programs on the file and writes the result
/// beside it, or into the working folder if the file is in an archive.
std::string command(const std::filesystem::path& input, const std::string& program,
                    const char* output_ending);

/// Reads the heights of a dataset by windows, in metres.
class HeightReader {
 public:
  /// @param dataset  must outlive this object.
  /// @param nodata   stored value that represents a missing height, besides the declared one and
  ///                 NaN.
  /// @param unit_m   unit of the values, m; if not set, the dataset's.
  /// @throws Error if it is no grid of heights, or their unit is unknown.
  HeightReader(GDALDataset& dataset, const OGRSpatialReference& crs, std::optional<double> nodata,
               std::optional<double> unit_m = {});

  /// Reads a window of the grid, row by row; NaN where there is no height, i.e. where GDAL's mask
  /// (declared nodata, a mask in the file or beside it) or the alpha band hides it. The values do
  /// not depend on the window.
  /// @throws Error if some cannot be read, or are infinite.
  void read(glm::ivec2 first, glm::ivec2 size, float* heights_m) const;

  GDALRasterBand& band() const { return *band_; }
  /// Returns a description of everything that converts stored values to heights.
  std::string conversion() const;

 private:
  GDALRasterBand* band_;
  GDALRasterBand* alpha_;  // marks holes; may be null
  GDALRasterBand* mask_;   // marks holes; may be null
  std::optional<double> nodata_;
  double scale_m_;
  double offset_m_;
};

/// Calls `work` with GDAL's messages kept from stderr, and prefixes its errors with the file's
/// name.
auto about(const std::filesystem::path& path, const auto& work) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  try {
    return work();
  } catch (const Error& error) {
    throw Error("{}: {}", path.string(), error.what());
  }
}

}  // namespace groundray
