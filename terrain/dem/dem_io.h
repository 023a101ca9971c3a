#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"

namespace groundray {

/// Digital elevation model as loaded: its surface in D, and the position of D.
struct Dem {
  HeightGrid grid;
  glm::dvec3 origin_w_m{0};  ///< D's origin in W, the DEM's CRS: whole metres
  std::string crs_wkt;       ///< CRS of W, WKT2:2019; empty if none is named
  /// Name for human readers: "NAD83 / UTM zone 15N (EPSG:26915)"; "local (no CRS)".
  std::string crs_name;
};

/// Options for reading a DEM that its file does not contain.
struct DemOptions {
  /// Stored value (before scale, offset and unit) that represents a missing height, besides the
  /// declared one and NaN.
  std::optional<double> nodata;
  /// Projected CRS in metres to warp to, in any form that GDAL accepts ("EPSG:32631", a PROJ
  /// string), or "utm": the WGS 84 UTM zone of the DEM's centre (UPS near the poles; a transverse
  /// Mercator about the centre on bodies other than the Earth). Empty: the file's CRS.
  std::string reproject_to;
};

/// Loads a DEM through GDAL: GeoTIFF, HGT, ESRI ASCII, PNG, VRT, netCDF, USGS DEM and every other
/// format that it reads with one band, or whose first band is named "elevation". GDAL's virtual
/// paths (/vsizip/...) and names of subdatasets are accepted as well.
///
/// Samples are points at the centres of GDAL's pixels. The band's scale, offset and unit of height
/// are applied (feet and others become metres). Holes are the declared nodata value, NaN, and
/// samples that a mask or an alpha band hides. A file without a CRS is a local grid in metres. A
/// file without a geotransform has cells of 1 m, its first row in the north and its south-western
/// corner at (0, 0). D's origin is the centre of the raster rounded to whole metres, at height 0.
///
/// A warp interpolates bilinearly (within half a cell of a hole or the edge, between the existing
/// samples) to square cells about as large as the file's, their size rounded to two digits. Heights
/// remain relative to the file's own vertical datum.
///
/// A truncated file is an error; only the library of classic netCDF (not netCDF-4) hides the
/// truncation and returns zeros.
///
/// Heights take 4 bytes per sample. GDAL's block cache is limited to 64 MiB unless GDAL_CACHEMAX is
/// set. Any number of threads may load.
/// @throws Error that names the file, if it is missing, no raster or truncated; has no heights; is
///         smaller than 2 x 2 or larger than 2^31 samples; has several bands or complex numbers;
///         has infinite heights or heights in an unknown unit; is positioned by ground control
///         points; or, unless `reproject_to` is set, is rotated, geographic or not in metres. In
///         the last case, the message contains the gdalwarp command for the same warp.
Dem load_dem(const std::filesystem::path& path, const DemOptions& options = {});

/// Returns whether two CRSs, as WKT, are equal, however they are worded: in plan, and in height
/// unless one of them has no vertical datum. False for text that is not WKT.
bool is_same_crs(const std::string& wkt, const std::string& other);

/// Properties of a DEM file that are known without loading it.
struct DemInfo {
  int columns = 0;
  int rows = 0;
  std::string driver;       ///< GDAL's short name of the format: "GTiff"
  std::string sample_type;  ///< GDAL's name of the sample type: "Float32"
  std::string crs_name;     ///< as in Dem
};

/// Returns the properties in the header of a DEM file.
/// @throws Error as load_dem if the file is no raster.
DemInfo inspect_dem(const std::filesystem::path& path);

/// Returns the heights with missing ones filled by GDALFillNodata (gdal_fillnodata.py), for
/// comparison: means of the data in eight directions, weighted by inverse distance.
/// @param size            columns and rows.
/// @param heights_m       row by row; NaN where there is none.
/// @param farthest_cells  search distance, at least 1; samples without data within it stay NaN.
/// @throws Error if the sizes disagree or GDAL fails.
std::vector<float> fill_by_gdal(glm::ivec2 size, std::span<const float> heights_m,
                                double farthest_cells);

}  // namespace groundray
