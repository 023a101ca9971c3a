#pragma once

#include <array>
#include <cstddef>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <vector>

#include "core/cell.h"
#include "core/height_grid.h"
#include "terrain/certificate.h"
#include "terrain/dem_file.h"
#include "terrain/lattice.h"
#include "terrain/node_level.h"

namespace groundray {

/// A square of one level of the lattice: 64 x 64 cells, or 8 x 8 nodes of 8 x 8 cells. Arrays go
/// row by row.
struct Tile {
  static constexpr int cells = 64;
  static constexpr int points = cells + 1;
  static constexpr int nodes = cells / Certificate::block_cells;
  using NodeValues = std::array<float, std::size_t{nodes} * nodes>;

  /// Metres; NaN in holes and beyond the DEM's last point. The last column and row are the first of
  /// the next tile.
  std::array<float, std::size_t{points} * points> heights_m;
  /// As in NodeLevel. Nodes beyond the lattice are as ones without any height: their key is -1.
  NodeValues key_m, deviation_m, full_m, low_m, high_m;
};

/// Names a tile: cells [64 which, 64 (which + 1)) of a level.
struct TileName {
  int level = 0;
  glm::ivec2 which{0};
  friend bool operator==(const TileName&, const TileName&) = default;
};

/// Columns and rows of tiles in a level.
inline glm::ivec2 tile_count(const Lattice& lattice, int level) {
  return (lattice.cells(level) - 1) / Tile::cells + 1;
}

/// Returns a tile of `level` without any height. @throws Error that names it if there is no such
/// tile.
std::shared_ptr<Tile> empty_tile(const Lattice& lattice, const TileName& name);

/// Returns a cell of the DEM from the tile of level 0 that it lies in.
inline Cell cell_of(const Tile& tile, glm::ivec2 cell) {
  const glm::ivec2 place = cell % Tile::cells;
  const float* const nw = &tile.heights_m[static_cast<std::size_t>(place.y) * Tile::points +
                                          static_cast<std::size_t>(place.x)];
  const float* const sw = nw + Tile::points;
  return {cell.x, cell.y, 1, 1, nw[0], nw[1], sw[0], sw[1]};
}

/// What a clipmap is made from: a certified DEM tile by tile. Any number of threads may ask.
class TileSource {
 public:
  virtual ~TileSource() = default;
  virtual const Lattice& lattice() const noexcept = 0;
  /// The largest finite key of a level: no node without holes has a larger one. Metres.
  virtual float max_key_m(int level) const = 0;
  /// Returns a tile. @throws Error that names the tile if it lies outside its level, and what it is
  /// read from if it cannot be read.
  virtual std::shared_ptr<const Tile> tile(const TileName& name) const = 0;
  /// Says which tiles are likely to be asked for next, the likeliest first; what was said before is
  /// forgotten. Returns at once. Does nothing where tiles are at hand anyway.
  virtual void prefetch(std::span<const TileName> /*names*/) const {}
};

/// Tiles of a DEM in memory.
class MemoryTiles final : public TileSource {
 public:
  /// @param levels  all levels of `grid`, certified for blocks of 8 x 8 cells with every detail.
  /// @throws Error if they are not.
  MemoryTiles(HeightGrid grid, std::vector<NodeLevel> levels);

  const Lattice& lattice() const noexcept override { return lattice_; }
  float max_key_m(int level) const override;
  std::shared_ptr<const Tile> tile(const TileName& name) const override;

 private:
  HeightGrid grid_;
  std::vector<NodeLevel> levels_;
  std::vector<float> max_key_m_;
  Lattice lattice_;
};

/// Tiles of a DEM file and its certificate. Tiles asked for last stay in a cache of bounded size.
/// Prefetched tiles are read into it by a thread in the background; one that cannot be read is left
/// out, so that the fault shows when the tile is asked for.
class FileTiles final : public TileSource {
 public:
  /// What was read so far, and what is kept.
  struct Statistics {
    std::size_t reads = 0;         ///< tiles read from files, or tried to be
    std::size_t cached_bytes = 0;  ///< of the tiles in the cache
  };

  /// @param certificate   of `dem`.
  /// @param cache_bytes   bound of the cache; below the size of one Tile nothing is cached. What
  ///                      callers hold does not count.
  FileTiles(DemFile dem, Certificate certificate, std::size_t cache_bytes);
  /// Waits for a tile that is being read, not for others that were to be prefetched.
  ~FileTiles() override;

  const Lattice& lattice() const noexcept override;
  float max_key_m(int level) const override;
  std::shared_ptr<const Tile> tile(const TileName& name) const override;
  void prefetch(std::span<const TileName> names) const override;

  /// Returns when all that is to be prefetched has been.
  void wait_for_prefetch() const;
  Statistics statistics() const;

 private:
  class Cache;
  std::unique_ptr<Cache> cache_;
};

}  // namespace groundray
