#pragma once

#include <array>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/cell.h"
#include "core/geometry/height_grid.h"
#include "terrain/dem/dem_file.h"
#include "terrain/lod/certificate.h"
#include "terrain/lod/lattice.h"

namespace groundray {

/// Square of one level of the lattice: 64 x 64 cells, or 8 x 8 nodes of 8 x 8 cells. Arrays are
/// stored row by row.
struct Tile {
  static constexpr int cells = 64;
  static constexpr int points = cells + 1;
  static constexpr int nodes = cells / Certificate::block_cells;
  using NodeValues = std::array<float, std::size_t{nodes} * nodes>;

  /// Metres; NaN in holes and beyond the DEM's last point. The last column and row are the first of
  /// the next tile.
  std::array<float, std::size_t{points} * points> heights_m;
  /// Values of the nodes, as in NodeLevel. Nodes beyond the lattice count as nodes without any
  /// height: their key is -1.
  NodeValues key_m, deviation_m, full_m, low_m, high_m;
};

/// Identifier of a tile: cells [64 which, 64 (which + 1)) of a level.
struct TileName {
  int level = 0;
  glm::ivec2 which{0};
  friend bool operator==(const TileName&, const TileName&) = default;
};

/// Returns the number of columns and rows of tiles in a level.
inline glm::ivec2 tile_count(const Lattice& lattice, int level) {
  return (lattice.cells(level) - 1) / Tile::cells + 1;
}

/// Returns a tile of `name.level` without any height.
/// @throws Error that names the tile if it does not exist.
std::shared_ptr<Tile> empty_tile(const Lattice& lattice, const TileName& name);

/// Calls act(index, sample) for each point of a tile that the lattice has: its index in heights_m
/// and its sample.
template <typename Act>
void for_each_point(const Lattice& lattice, const TileName& name, const Act& act) {
  const glm::ivec2 first = name.which * Tile::cells;
  const glm::ivec2 size = glm::min(glm::ivec2(Tile::points), lattice.points(name.level) - first);
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      act(static_cast<std::size_t>(y) * Tile::points + static_cast<std::size_t>(x),
          lattice.sample(name.level, first + glm::ivec2(x, y)));
    }
  }
}

/// Returns a cell of the DEM from the tile of level 0 that contains it.
inline Cell cell_of(const Tile& tile, glm::ivec2 cell) {
  const glm::ivec2 place = cell % Tile::cells;
  const float* const nw = &tile.heights_m[static_cast<std::size_t>(place.y) * Tile::points +
                                          static_cast<std::size_t>(place.x)];
  const float* const sw = nw + Tile::points;
  return {cell.x, cell.y, 1, 1, nw[0], nw[1], sw[0], sw[1]};
}

/// Source of the tiles of a certified DEM, from which clipmaps are made. Any number of threads may
/// use it.
class TileSource {
 public:
  virtual ~TileSource() = default;
  virtual const Lattice& lattice() const noexcept = 0;
  /// Returns the largest finite key of a level, metres: no node without holes has a larger one.
  virtual float max_key_m(int level) const = 0;
  /// Returns a tile.
  /// @throws Error that names the tile if it lies outside its level, or the tile and its file if it
  ///         cannot be read.
  virtual std::shared_ptr<const Tile> tile(const TileName& name) const = 0;
  /// Announces the tiles that are likely to be requested next, most likely first, and replaces
  /// earlier announcements. Returns immediately. Does nothing if tiles need no reading.
  virtual void prefetch(std::span<const TileName> /*names*/) const {}
};

/// Tiles of a DEM in memory.
class MemoryTiles final : public TileSource {
 public:
  /// @param levels  all levels of `grid`, certified for blocks of 8 x 8 cells with
  ///                NodeDetail::Full.
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

/// Tiles of a DEM file and its certificate. The most recently used tiles stay in a cache of bounded
/// size. A background thread reads prefetched tiles into it. If one cannot be read, it is omitted,
/// and the error occurs when the tile is requested.
class FileTiles final : public TileSource {
 public:
  /// Statistics of reads, and size of the cache.
  struct Statistics {
    std::size_t reads = 0;         ///< tiles read from files, including failed attempts
    std::size_t cached_bytes = 0;  ///< size of the tiles in the cache
  };

  /// @param certificate  of `dem`.
  /// @param cache_bytes  limit of the cache; below the size of one Tile nothing is cached. Tiles
  ///                     that callers hold do not count.
  FileTiles(DemFile dem, Certificate certificate, std::size_t cache_bytes);
  /// Waits for a tile that is being read, but not for further prefetches.
  ~FileTiles() override;

  const Lattice& lattice() const noexcept override;
  float max_key_m(int level) const override;
  std::shared_ptr<const Tile> tile(const TileName& name) const override;
  void prefetch(std::span<const TileName> names) const override;

  /// Waits until all announced tiles have been prefetched.
  void wait_for_prefetch() const;
  Statistics statistics() const;

 private:
  class Cache;
  std::unique_ptr<Cache> cache_;
};

}  // namespace groundray
