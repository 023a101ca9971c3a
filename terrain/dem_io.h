#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "terrain/dem.h"

namespace groundray {

/// What to do with a DEM beyond what its file says.
struct DemOptions {
  std::optional<double> nodata;  ///< a value that means "no height", besides the declared one and NaN
  std::string reproject_to;      ///< a CRS to warp to ("EPSG:32631"; "utm" for the fitting UTM zone); empty: keep
};

/// Loads a DEM through GDAL: GeoTIFF, HGT, ESRI ASCII, PNG16, VRT, netCDF, USGS DEM and whatever else it reads as one band.
/// Samples are points at pixel centres; scale and offset of the band and units of feet are honoured.
/// D's origin is the centre of the raster rounded to whole metres, at height 0.
/// @throws Error for a missing or unreadable file, a raster without heights, one smaller than 2 x 2, a rotated one,
///         infinite heights, several bands, or a geographic CRS (with the gdalwarp line to run).
Dem load_dem(const std::filesystem::path& path, const DemOptions& options = {});

/// What can be told of a DEM file without loading it.
struct DemInfo {
  int columns = 0;
  int rows = 0;
  std::string driver;       ///< GDAL's name of the format
  std::string sample_type;  ///< GDAL's name of the sample type: "Float32"
  std::string crs_name;
};

/// Returns what the header of a DEM file says. @throws Error as load_dem for files that are no raster.
DemInfo inspect_dem(const std::filesystem::path& path);

}  // namespace groundray
