#pragma once

// Private to the library: the files of a certificate, and what is written about them.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "terrain/certificate.h"
#include "terrain/dem_file.h"
#include "terrain/lattice.h"
#include "terrain/node_level.h"
#include "terrain/tiled_tiff.h"

namespace groundray {

/// What a certificate holds besides its rasters.
struct CertificateSummary {
  std::vector<LevelSummary> levels;
  /// The nodes of the levels that have but one, from the finest such level on.
  std::vector<NodeLevel> single_nodes;
};

/// How many levels have more than one node or are level 0: those that the raster of nodes holds.
int raster_levels(const Lattice& lattice);

/// The names of all rasters of a certificate.
std::vector<std::string> raster_names(const Lattice& lattice);

/// The raster of nodes: one image for each level of raster_levels.
constexpr const char* nodes_name = "nodes.tif";
TiffSpec nodes_spec(const Lattice& lattice, const DemHeader& dem);

/// The raster of the heights of a level from 1 on.
std::string heights_name(int level);
TiffSpec heights_spec(const Lattice& lattice, const DemHeader& dem, int level);

/// Writes certificate.txt into a folder that holds all rasters.
/// @param key  what the certificate is valid for.
void write_summary(const std::filesystem::path& folder, const std::string& key,
                   const Lattice& lattice, const CertificateSummary& summary);

/// Returns what certificate.txt says, or nothing if it or a raster is missing, damaged or of
/// another key.
std::optional<CertificateSummary> read_summary(const std::filesystem::path& folder,
                                               const std::string& key, const Lattice& lattice);

/// Folders where the certificate of a DEM may be, in the order to look.
std::vector<std::filesystem::path> certificate_folders(const DemFile& dem);

/// A folder that appears when whole: filled beside its place, under its name and ".part". One
/// process at a time makes one; a second waits for the first.
class FolderInMaking {
 public:
  /// Returns the folder to fill, empty; nothing if the place cannot be written to, or has files
  /// that are not a certificate's. @throws Error if the disk is full.
  static std::optional<FolderInMaking> begin(const std::filesystem::path& place);
  ~FolderInMaking();
  FolderInMaking(FolderInMaking&& other) noexcept;
  FolderInMaking& operator=(FolderInMaking&&) = delete;

  const std::filesystem::path& path() const { return aside_; }

  /// Puts it in its place; what was there is deleted. @throws Error if that fails.
  void publish();

 private:
  FolderInMaking(std::filesystem::path place, std::filesystem::path aside, int lock)
      : place_(std::move(place)), aside_(std::move(aside)), lock_(lock) {}
  std::filesystem::path place_, aside_;  // aside_ is empty once published
  int lock_;                             // file descriptor of the folder, locked; -1 for none
};

}  // namespace groundray
