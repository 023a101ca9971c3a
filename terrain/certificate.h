#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/dem_file.h"
#include "terrain/lattice.h"
#include "terrain/node_level.h"

namespace groundray {

/// What the nodes of a level have in common.
struct LevelSummary {
  std::size_t nodes = 0;
  std::size_t mixed = 0;  ///< nodes with holes
  std::size_t empty = 0;  ///< nodes without any height
  float max_key_m = 0;    ///< largest finite key; 0 if there is none
  /// Of NodeLevel::deviation_m, over nodes that are not empty; 0 if all are.
  float max_deviation_m = 0;
  double mean_deviation_m = 0;
  friend bool operator==(const LevelSummary&, const LevelSummary&) = default;
};

/// What is kept of a DEM file so that it need not be read as a whole again: its heights at the
/// coarser levels (every 2^k-th sample), and how far each node of each level is from the reference
/// surface, for blocks of 8 x 8 cells.
///
/// It lies in files (see docs/formats.md), in a folder beside the DEM, `<its name>.groundray`, or,
/// where that cannot be written, below `$XDG_CACHE_HOME/groundray` (`~/.cache/groundray`). It is
/// valid as long as DemFile::fingerprint stays the same and its files are whole as far as sizes and
/// samples of their bytes tell; tiles have checksums besides. Any number of threads may read.
class Certificate {
 public:
  static constexpr int block_cells = 8;

  /// Told now and then which share of the work is done, 0 to 1. What it throws ends the work.
  using Progress = std::function<void(double share)>;

  /// How a certificate is made. What it says does not depend on it.
  struct Making {
    Progress progress;
    /// Cells along a side of the tiles that are worked on one by one, a power of two from 8 on.
    /// Memory grows with its square: about 0.3 GB for 4096, whatever the DEM's size.
    int tile_cells = 4096;
  };

  /// Opens the certificate of `dem`, or makes it: in two passes over the file, which take minutes
  /// for 10^9 samples. While another process makes it, waits for that.
  /// @throws Error if the DEM cannot be read, has no height at all or changes meanwhile; if there
  ///         is no folder to write to or the disk is full. Nothing half-made stays behind.
  static Certificate open_or_make(const DemFile& dem, const Making& making);
  static Certificate open_or_make(const DemFile& dem) { return open_or_make(dem, {}); }

  /// Opens the certificate of `dem` if there is one. @throws Error if the DEM cannot be read.
  static std::optional<Certificate> open(const DemFile& dem);

  ~Certificate();
  Certificate(Certificate&&) noexcept;
  Certificate& operator=(Certificate&&) noexcept;

  const Lattice& lattice() const noexcept;
  /// One for each level, 0 to Lattice::top_level().
  const std::vector<LevelSummary>& levels() const noexcept;
  /// Where the files are.
  const std::filesystem::path& folder() const noexcept;

  /// Returns heights of `size` points of a level from 1 on, row by row: metres, NaN in holes.
  /// @throws Error that names the file if they cannot be read, or the window leaves the level.
  std::vector<float> heights(int level, glm::ivec2 first, glm::ivec2 size) const;

  /// Returns `size` nodes of a level from node `first` on. @throws Error as heights.
  NodeLevel nodes(int level, glm::ivec2 first, glm::ivec2 size) const;

 private:
  struct Files;
  explicit Certificate(std::unique_ptr<const Files> files);
  static std::optional<Certificate> open_in(const std::filesystem::path& folder,
                                            const std::string& key, const DemHeader& dem);
  std::unique_ptr<const Files> files_;
};

}  // namespace groundray
