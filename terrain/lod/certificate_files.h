#pragma once

// Private to the library: the files of a certificate, their summary, and their computation.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem/dem_file.h"
#include "terrain/dem/tiled_tiff.h"
#include "terrain/lod/certificate.h"
#include "terrain/lod/lattice.h"

namespace groundray {

/// Content of a certificate apart from its rasters.
struct CertificateSummary {
  std::vector<LevelSummary> levels;
  /// Nodes of the levels that have only one and are not in the node raster, finest level first.
  std::vector<NodeLevel> single_nodes;
};

/// Returns the number of levels in the node raster: level 0 and all levels with more than one node.
int raster_levels(const Lattice& lattice);

/// Returns the file names of all rasters of a certificate.
std::vector<std::string> raster_names(const Lattice& lattice);

/// Name of the node raster, which has one image for each of the raster_levels().
constexpr const char* nodes_name = "nodes.tif";
TiffSpec nodes_spec(const Lattice& lattice, const DemHeader& dem);

/// Returns the name of the height raster of a level, 1 or higher.
std::string heights_name(int level);
TiffSpec heights_spec(const Lattice& lattice, const DemHeader& dem, int level);

/// Writes certificate.txt into a folder that holds all rasters.
/// @param key  conditions under which the certificate is valid.
void write_summary(const std::filesystem::path& folder, const std::string& key,
                   const Lattice& lattice, const CertificateSummary& summary);

/// Returns the content of certificate.txt; nothing if it or a raster is missing or damaged, or if
/// it has another key.
std::optional<CertificateSummary> read_summary(const std::filesystem::path& folder,
                                               const std::string& key, const Lattice& lattice);

/// Returns the folders that may hold the certificate of a DEM, in search order.
std::vector<std::filesystem::path> certificate_folders(const DemFile& dem);

/// Folder that appears only when complete. It is filled beside its final position, under its name
/// with ".part" appended. One process at a time fills it; a second one waits for the first.
class FolderInMaking {
 public:
  /// Returns the folder to fill, empty; nothing if `place` cannot be written or holds files that do
  /// not belong to a certificate.
  /// @throws Error if the disk is full.
  static std::optional<FolderInMaking> begin(const std::filesystem::path& place);
  ~FolderInMaking();
  FolderInMaking(FolderInMaking&& other) noexcept;
  FolderInMaking& operator=(FolderInMaking&&) = delete;

  const std::filesystem::path& path() const { return aside_; }

  /// Moves the folder to its final position, where it replaces any previous one.
  /// @throws Error if that fails.
  void publish();

 private:
  FolderInMaking(std::filesystem::path place, std::filesystem::path aside, int lock)
      : place_(std::move(place)), aside_(std::move(aside)), lock_(lock) {}
  std::filesystem::path place_, aside_;  // aside_ is empty once published
  int lock_;                             // locked file descriptor of the folder; -1 for none
};

/// Writes the rasters of the DEM's certificate into `folder`. Both passes visit square tiles of the
/// DEM in Z order, so that the tiles of each raster are completed one after the other and only a
/// few of them are in memory.
/// @throws Error if the DEM cannot be read or has no height, or the files cannot be written.
CertificateSummary certify_file(const DemFile& dem, const Lattice& lattice,
                                const std::filesystem::path& folder,
                                const Certificate::Settings& settings);

}  // namespace groundray
