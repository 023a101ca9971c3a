#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem_raster.h"

namespace groundray {

/// Says why `crs` cannot be W, a plane in metres; empty if it can.
std::string why_not_metric(const OGRSpatialReference& crs);

/// Returns the UTM (near the poles UPS) zone of the raster's centre, or for another body than the
/// Earth a transverse Mercator about it, as gdalwarp -t_srs wants it.
std::string fitting_crs(const RasterHeader& raster);

/// Refuses a raster whose samples are no grid of metres. @throws Error with the command that makes
/// one of it.
void check_placed(GDALDataset& dataset, const RasterHeader& header, std::optional<double> nodata);

/// The heights of a raster as seen in another CRS: computed block by block when they are read, so
/// that the raster may be of any size, and the same whatever windows they are read in.
class WarpedHeights {
 public:
  /// @param source  must outlive this.
  WarpedHeights(const HeightReader& source, const RasterHeader& header, const std::string& target);
  ~WarpedHeights();
  WarpedHeights(const WarpedHeights&) = delete;
  WarpedHeights& operator=(const WarpedHeights&) = delete;

  const RasterHeader& header() const { return header_; }
  /// As HeightReader::read; the columns and rows of a message about infinite heights are the
  /// source's.
  void read(glm::ivec2 first, glm::ivec2 size, float* heights_m) const;

 private:
  class Source;
  std::unique_ptr<Source> source_;  // outlives the view
  GDALDatasetUniquePtr view_;
  RasterHeader header_;
};

/// Returns `raster` as seen in the CRS that `reproject_to` names (see DemOptions); null if it is
/// there already. @throws Error if there is no way there, or that is no plane in metres.
std::unique_ptr<WarpedHeights> reprojected(const HeightReader& raster, const RasterHeader& header,
                                           const std::string& reproject_to);

}  // namespace groundray
