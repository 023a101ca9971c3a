#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem/dem_file.h"
#include "terrain/lod/lattice.h"

namespace groundray {

/// Summary of the nodes of a level.
struct LevelSummary {
  std::size_t nodes = 0;
  std::size_t mixed = 0;  ///< nodes with holes
  std::size_t empty = 0;  ///< nodes without any height
  float max_key_m = 0;    ///< largest finite key; 0 if there is none
  /// Largest NodeLevel::deviation_m over nodes that are not empty; 0 if all are.
  float max_deviation_m = 0;
  double mean_deviation_m = 0;
  friend bool operator==(const LevelSummary&, const LevelSummary&) = default;
};

/// Derived data of a DEM file, kept so that the DEM need not be read as a whole again: its heights
/// on the coarser levels (every 2^k-th sample), and the deviation of each node of each level from
/// the reference surface, for blocks of 8 x 8 cells.
///
/// The files (docs/reference/formats.md) are in a folder beside the DEM, `<its name>.groundray`,
/// or, if that cannot be written, below `$XDG_CACHE_HOME/groundray` (`~/.cache/groundray`). A
/// certificate is valid while DemFile::fingerprint stays the same and its files are intact, as far
/// as their sizes and samples of their bytes show; in addition, each tile has a checksum. Any
/// number of threads may read.
class Certificate {
 public:
  static constexpr int block_cells = 8;

  /// Progress callback: receives the fraction of the work that is done, 0 to 1. An exception that
  /// it throws ends the work.
  using Progress = std::function<void(double share)>;

  /// Options for computing a certificate. The values in the certificate do not depend on them.
  struct Settings {
    Progress progress;
    /// Side of the tiles that are processed one by one, in cells: a power of two, at least 8.
    /// Memory grows with its square: about 0.3 GB for 4096, whatever the DEM's size.
    int tile_cells = 4096;
  };

  /// Opens the certificate of `dem`, or computes it in two passes over the file, which take minutes
  /// for 10^9 samples. Waits if another process is computing it.
  /// @throws Error if the DEM cannot be read, has no height at all or changes meanwhile; if there
  ///         is no writable folder or the disk is full. No incomplete files remain.
  static Certificate open_or_make(const DemFile& dem, const Settings& settings);
  static Certificate open_or_make(const DemFile& dem) { return open_or_make(dem, {}); }

  /// Opens the certificate of `dem` if there is a valid one.
  /// @throws Error if the DEM cannot be read.
  static std::optional<Certificate> open(const DemFile& dem);

  ~Certificate();
  Certificate(Certificate&&) noexcept;
  Certificate& operator=(Certificate&&) noexcept;

  const Lattice& lattice() const noexcept;
  /// Returns the summaries of levels 0 to Lattice::top_level().
  const std::vector<LevelSummary>& levels() const noexcept;
  /// Returns the folder that holds the files.
  const std::filesystem::path& folder() const noexcept;

  /// Returns the heights of `size` points of a level, 1 or higher, from point `first` on, row by
  /// row: metres, NaN in holes.
  /// @throws Error that names the file if they cannot be read, or if the window exceeds the level.
  std::vector<float> heights(int level, glm::ivec2 first, glm::ivec2 size) const;

  /// Returns `size` nodes of a level from node `first` on.
  /// @throws Error as heights.
  NodeLevel nodes(int level, glm::ivec2 first, glm::ivec2 size) const;

 private:
  struct Files;
  explicit Certificate(std::unique_ptr<const Files> files);
  static std::optional<Certificate> open_in(const std::filesystem::path& folder,
                                            const std::string& key, const DemHeader& dem);
  std::unique_ptr<const Files> files_;
};

}  // namespace groundray
