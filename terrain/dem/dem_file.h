#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "terrain/dem/dem_io.h"

namespace groundray {

/// Grid and CRS of a DEM file; members as in Dem and its HeightGrid.
struct DemHeader {
  glm::ivec2 samples{0};  ///< columns and rows, each 2 to 2^30
  glm::dvec2 origin_m{0};
  glm::dvec2 step_m{1};
  glm::dvec3 origin_w_m{0};
  std::string crs_wkt;
  std::string crs_name;
};

/// DEM file opened for reading by windows. It may have any size, because only windows are in
/// memory.
///
/// Heights are those of load_dem, bit for bit, whatever windows they are read in. Reprojected
/// heights are computed block by block as they are read. Windows are cheap if the file is tiled.
/// From a file stored row by row, whole rows are read; from a PNG, all rows above as well.
///
/// GDAL's block cache, which all files share, is limited to 64 MiB unless GDAL_CACHEMAX is set. Any
/// number of threads may read, one at a time.
class DemFile {
 public:
  /// @throws Error as load_dem, except for conditions that only the samples reveal. The size is
  ///         rejected only if a side has fewer than 2 or more than 2^30 samples.
  explicit DemFile(const std::filesystem::path& path, const DemOptions& options = {});
  ~DemFile();
  DemFile(DemFile&&) noexcept;
  DemFile& operator=(DemFile&&) noexcept;

  const std::filesystem::path& path() const noexcept;
  const DemOptions& options() const noexcept;
  const DemHeader& header() const noexcept;

  /// Returns `size` samples from sample `first` on, row by row: heights in metres, NaN in holes.
  /// @throws Error that names the file and the position if samples cannot be read or are infinite,
  ///         or if the window exceeds the grid.
  std::vector<float> read(glm::ivec2 first, glm::ivec2 size) const;

  /// Returns all samples.
  /// @throws Error as load_dem.
  Dem load() const;

  /// Returns a description of everything that determines the heights, as lines of text: path,
  /// options, header, size and time of each file involved (including those of a mosaic), and a hash
  /// of samples at fixed positions. Equal texts mean equal heights, as far as this can be known
  /// without reading all of them.
  /// @throws Error if the samples cannot be read.
  std::string fingerprint() const;

 private:
  struct Opened;
  std::unique_ptr<Opened> opened_;
};

}  // namespace groundray
