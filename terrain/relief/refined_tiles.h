#pragma once

#include <memory>
#include <optional>

#include "terrain/lod/tile_source.h"
#include "terrain/relief/relief.h"
#include "terrain/relief/trail_nodes.h"

namespace groundray {

/// Tiles of a DEM with relief, computed on demand. Levels below the relief's exponent have cells
/// finer than the DEM's; the others are the DEM's levels with displaced samples.
///
/// Deviations and keys are upper bounds, and boxes contain the node's samples but may be larger
/// (docs/reference/relief.md):
///  - below the DEM's cells, the templates coincide with the DEM's surface, so that a node deviates
///    exactly as the displacement does, apart from the rounding of heights to float;
///  - from the DEM's cells on, the bound is the deviation of the DEM's node, plus the range of the
///    displacement, plus rounding.
/// Nodes that trails change have values of their own (TrailNodes).
class RefinedTiles final : public TileSource {
 public:
  RefinedTiles(std::shared_ptr<const TileSource> dem, std::shared_ptr<const Relief> relief);

  const Lattice& lattice() const noexcept override { return lattice_; }
  float max_key_m(int level) const override;
  std::shared_ptr<const Tile> tile(const TileName& name) const override;
  void prefetch(std::span<const TileName> names) const override;

 private:
  TileName below(const TileName& name) const noexcept;
  std::shared_ptr<Tile> finer_tile(const TileName& name) const;
  std::shared_ptr<Tile> displaced_tile(const TileName& name) const;
  void add_trails(const TileName& name, Tile& tile) const;

  std::shared_ptr<const TileSource> dem_;
  std::shared_ptr<const Relief> relief_;
  Lattice lattice_;
  std::optional<TrailNodes> trails_;
  double rounding_m_ = 0;  // bound for all heights
};

}  // namespace groundray
