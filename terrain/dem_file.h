#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "terrain/dem_io.h"

namespace groundray {

/// What a DEM file says of its grid: as in Dem and its HeightGrid.
struct DemHeader {
  glm::ivec2 samples{0};  ///< columns and rows, each 2 to 2^30
  glm::dvec2 origin_m{0};
  glm::dvec2 step_m{1};
  glm::dvec3 origin_w_m{0};
  std::string crs_wkt;
  std::string crs_name;
};

/// A DEM file opened for reading by windows: of any size, for only windows are ever in memory.
///
/// Its heights are load_dem's, bit for bit, whatever windows they are read in. Reprojected heights
/// are computed as they are read, block by block. Windows are cheap where the file is stored in
/// tiles; of one stored row by row they cost whole rows, of PNG all rows above as well.
///
/// GDAL's cache of blocks, which all files share, is limited to 64 MiB unless GDAL_CACHEMAX is set.
/// Any number of threads may read, one at a time.
class DemFile {
 public:
  /// @throws Error as load_dem, but for what only reading the samples tells, and of sizes only for
  ///         more than 2^30 samples on a side.
  explicit DemFile(const std::filesystem::path& path, const DemOptions& options = {});
  ~DemFile();
  DemFile(DemFile&&) noexcept;
  DemFile& operator=(DemFile&&) noexcept;

  const std::filesystem::path& path() const noexcept;
  const DemOptions& options() const noexcept;
  const DemHeader& header() const noexcept;

  /// Returns `size` samples from sample `first` on, row by row: heights in metres, NaN in holes.
  /// @throws Error that names file and window if some cannot be read, are infinite, or the window
  ///         leaves the grid.
  std::vector<float> read(glm::ivec2 first, glm::ivec2 size) const;

  /// Returns what the heights follow from, as lines of text: path, options, header, size and time
  /// of each file involved (those that a mosaic names), and a hash of samples at fixed places.
  /// Equal texts mean equal heights as far as that can be told without reading all of them.
  /// @throws Error if the samples cannot be read.
  std::string fingerprint() const;

 private:
  struct Opened;
  std::unique_ptr<Opened> opened_;
};

}  // namespace groundray
