#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem/dem_raster.h"

namespace groundray {

/// Returns the reason why `crs` cannot be W, a plane in metres; empty if it can.
std::string why_not_metric(const OGRSpatialReference& crs);

/// Returns a suitable CRS for W, in the form of gdalwarp -t_srs: the UTM zone of the raster's
/// centre (UPS near the poles), or a transverse Mercator about it on bodies other than the Earth.
std::string fitting_crs(const RasterHeader& raster);

/// Rejects a raster whose samples do not form a grid in metres.
/// @throws Error with the command that converts it.
void check_placed(GDALDataset& dataset, const RasterHeader& header, std::optional<double> nodata);

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

}  // namespace groundray
