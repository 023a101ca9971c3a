#pragma once

// Private to the library's readers and writers of rasters: the one header that lets GDAL in.
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

/// What a dataset says of its grid.
struct RasterHeader {
  glm::ivec2 samples{0};
  std::array<double, 6> geotransform{};  ///< GDAL's: of corners of pixels
  OGRSpatialReference crs;

  bool is_rotated() const { return geotransform[2] != 0 || geotransform[4] != 0; }
  bool has_place_on_a_body() const { return !crs.IsEmpty() && !crs.IsLocal(); }
  /// In the CRS's own unit.
  glm::dvec2 centre() const;
};

/// Loads GDAL's drivers, once; and cuts its cache of blocks, by default a share of the machine's
/// memory, down to 64 MiB, unless GDAL_CACHEMAX sets it. Comes before all other use of GDAL.
void start_gdal();

/// Opens a dataset of at least one band. @throws Error if there is none.
GDALDatasetUniquePtr open_raster(const std::filesystem::path& path);

/// @param placing  the program that places a raster by its ground control points.
/// @throws Error if the grid has no place, or cells without area.
RasterHeader read_header(GDALDataset& dataset, const char* placing = "gdalwarp -ot Float32");

/// Returns the CRS's name for people: "NAD83 / UTM zone 15N (EPSG:26915)"; "local (no CRS)".
std::string name_of(const OGRSpatialReference& crs);

/// Returns the CRS as WKT2:2019 on one line; empty if it is.
std::string wkt_of(const OGRSpatialReference& crs);

/// Returns `word` as a shell takes it for one word.
std::string shell_word(const std::string& word);

/// Returns the line that runs a program of GDAL's on the file and writes beside it, or in the
/// working folder if it lies in an archive.
std::string command(const std::filesystem::path& input, const std::string& program,
                    const char* output_ending);

/// Reads the heights of a dataset by windows, in metres.
class HeightReader {
 public:
  /// @param dataset  must outlive this.
  /// @param nodata   a stored value that means "no height", besides the declared one and NaN.
  /// @param unit_m   the unit of the values, unless it is the dataset's to say.
  /// @throws Error if it is no grid of heights, or their unit is unknown.
  HeightReader(GDALDataset& dataset, const OGRSpatialReference& crs, std::optional<double> nodata,
               std::optional<double> unit_m = {});

  /// Reads a window of the grid, row by row; NaN where there is no height: where GDAL's mask
  /// (declared nodata, a mask in the file or beside it) or the alpha band hides it. The values do
  /// not depend on the window that they are read in.
  /// @throws Error if some cannot be read, or are infinite.
  void read(glm::ivec2 first, glm::ivec2 size, float* heights_m) const;

  GDALRasterBand& band() const { return *band_; }
  /// All that turns stored values into heights.
  std::string conversion() const;

 private:
  GDALRasterBand* band_;
  GDALRasterBand* alpha_;  // marks holes; may be null
  GDALRasterBand* mask_;   // likewise
  std::optional<double> nodata_;
  double scale_m_;
  double offset_m_;
};

/// Calls `work` with GDAL's messages kept from stderr, and has errors say which file they are
/// about.
auto about(const std::filesystem::path& path, const auto& work) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  try {
    return work();
  } catch (const Error& error) {
    throw Error("{}: {}", path.string(), error.what());
  }
}

}  // namespace groundray
