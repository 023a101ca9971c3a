#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "terrain/dem.h"

namespace groundray {

/// What to do with a DEM beyond what its file says.
struct DemOptions {
  /// A stored value (before scale, offset and unit) that means "no height", besides the declared
  /// one and NaN.
  std::optional<double> nodata;
  /// A projected CRS in metres to warp to, in GDAL's words ("EPSG:32631", a PROJ string), or "utm":
  /// the WGS 84 UTM zone of the DEM's centre (UPS near the poles; on other bodies than the Earth a
  /// transverse Mercator about the centre). Empty: keep the file's.
  std::string reproject_to;
};

/// Loads a DEM through GDAL: GeoTIFF, HGT, ESRI ASCII, PNG, VRT, netCDF, USGS DEM and whatever else
/// it reads as one band, or whose first band has the name "elevation"; its virtual paths
/// (/vsizip/...) and names of subdatasets serve as well.
///
/// Samples are points at the centres of GDAL's pixels. The band's scale, offset and unit of height
/// (feet and others become metres) are honoured. Holes are the declared nodata value, NaN, and what
/// a mask or an alpha band hides. A file without CRS is a local grid in metres; one without
/// geotransform as well has cells of 1 m, its first row in the north and its south-western corner
/// at (0, 0). D's origin is the centre of the raster rounded to whole metres, at height 0.
///
/// A warp interpolates bilinearly (within half a cell of a hole or the edge, between the samples
/// that there are) to square cells about as large as the file's, their size rounded to two digits.
/// Heights stay above the file's own vertical datum.
///
/// A file cut short is an error; only the library of classic netCDF (not netCDF-4) hides it and
/// gives zeros.
///
/// Heights take 4 bytes for each sample. GDAL's cache of blocks is limited to 64 MiB, unless
/// GDAL_CACHEMAX is set. Any number of threads may load.
/// @throws Error that names the file, for one that is missing, no raster or cut short; without
///         heights; smaller than 2 x 2 or larger than 2^31 samples; of several bands or complex
///         numbers; with infinite heights or heights in an unknown unit; placed by ground control
///         points; and, unless `reproject_to` is set, for one that is rotated, geographic or not in
///         metres, with the gdalwarp line that does the same warp.
Dem load_dem(const std::filesystem::path& path, const DemOptions& options = {});

/// Returns whether two CRSs, as WKT, are one, however they are worded: in plan, and in height
/// unless one of them tells no datum of heights. False for what is no WKT.
bool is_same_crs(const std::string& wkt, const std::string& other);

/// What can be told of a DEM file without loading it.
struct DemInfo {
  int columns = 0;
  int rows = 0;
  std::string driver;       ///< GDAL's short name of the format: "GTiff"
  std::string sample_type;  ///< GDAL's name of the sample type: "Float32"
  std::string crs_name;     ///< as in Dem
};

/// Returns what the header of a DEM file says.
/// @throws Error as load_dem for files that are no raster.
DemInfo inspect_dem(const std::filesystem::path& path);

}  // namespace groundray
