#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem/gdal_raster.h"

namespace groundray {

/// Returns the reason why `crs` cannot be W, a plane in metres; empty if it can.
std::string why_not_metric(const OGRSpatialReference& crs);

/// Returns a suitable CRS for W, in the form of gdalwarp -t_srs: the UTM zone of the raster's
/// centre (UPS near the poles), or a transverse Mercator about it on bodies other than the Earth.
std::string fitting_crs(const RasterHeader& raster);

/// Rejects a raster whose samples do not form a grid in metres.
/// @throws Error with the command that converts it.
void check_placed(GDALDataset& dataset, const RasterHeader& header, std::optional<double> nodata);

/// Returns a view of `source` warped by gdalwarp with `options`, computed as it is read; null if
/// GDAL cannot warp it.
GDALDatasetUniquePtr warped_view(GDALDataset& source, const std::vector<std::string>& options);

/// Heights of a raster, warped to another CRS. They are computed block by block as they are read,
/// so that the raster may be of any size, and do not depend on the windows they are read in.
class WarpedHeights {
 public:
  /// @param source  must outlive this object.
  WarpedHeights(const HeightReader& source, const RasterHeader& header, const std::string& target);
  ~WarpedHeights();
  WarpedHeights(const WarpedHeights&) = delete;
  WarpedHeights& operator=(const WarpedHeights&) = delete;

  const RasterHeader& header() const { return header_; }
  /// Reads a window as HeightReader::read does. If a height is infinite, the message gives the
  /// column and row of the source.
  void read(glm::ivec2 first, glm::ivec2 size, float* heights_m) const;

 private:
  class Source;
  std::unique_ptr<Source> source_;  // must outlive view_
  GDALDatasetUniquePtr view_;
  RasterHeader header_;
};

/// Returns `raster` warped to the CRS that `reproject_to` names (see DemOptions); null if it has
/// that CRS already and is not rotated.
/// @throws Error if there is no transformation to that CRS, or if that CRS is no plane in metres.
std::unique_ptr<WarpedHeights> reprojected(const HeightReader& raster, const RasterHeader& header,
                                           const std::string& reproject_to);

/// Values of a raster of one band in W, row by row; NaN where there is none.
struct PlacedRaster {
  glm::ivec2 size{0};         ///< columns and rows of pixels
  glm::dvec2 corner_w_m{0};   ///< outer corner of pixel (0, 0), in W
  glm::dvec2 step_m{1};       ///< offset from one pixel to the next; may be negative
  bool is_warped = false;     ///< true if the pixels differ from the file's
  std::vector<float> values;  ///< after scale and offset; units are ignored
};

/// Loads a raster, warped bilinearly if its CRS is not W's; one without a CRS is assumed to be in
/// W.
/// @param nodata   stored value for "no value", besides the declared one.
/// @param crs_wkt  CRS of W, as in Dem.
/// @throws Error as load_dem, or for more than `most_pixels`.
PlacedRaster load_placed_raster(const std::filesystem::path& path, std::optional<double> nodata,
                                const std::string& crs_wkt, std::int64_t most_pixels);

/// Returns the horizontal CRS of W if a raster has to be brought into it; nothing if one of the two
/// has no CRS, or if both have the same local one.
/// @param raster  horizontal CRS of the raster.
/// @throws Error if there is no transformation from one to the other.
std::optional<OGRSpatialReference> crs_to_reach(const OGRSpatialReference& raster,
                                                const std::string& crs_wkt);

/// Removes the vertical part of a CRS.
void flatten(OGRSpatialReference& crs);

/// Checks the number of pixels of a raster.
/// @param source  columns and rows of the file.
/// @param result  columns and rows in W.
/// @throws Error if `result` has more than `most_pixels`, with the command that scales the file
///         down.
void check_pixels(const std::filesystem::path& path, glm::ivec2 source, glm::ivec2 result,
                  std::int64_t most_pixels);

}  // namespace groundray
