#pragma once

#include <memory>

#include "terrain/relief.h"
#include "terrain/tile_source.h"

namespace groundray {

/// Tiles of a DEM with relief on it, computed when they are asked for. Levels below the relief's
/// exponent have cells finer than the DEM's; those from there on are the DEM's with displaced
/// samples.
///
/// Deviations and keys are upper bounds here, and boxes hold the node's samples but need not touch
/// them:
///  - below the DEM's cells the DEM is one with its templates, so that a node deviates as the
///    displacement does, exactly, but for the rounding of heights to float;
///  - from there on as its node of the DEM at most, and the displacement's span, and rounding.
class RefinedTiles final : public TileSource {
 public:
  RefinedTiles(std::shared_ptr<const TileSource> dem, std::shared_ptr<const Relief> relief);

  const Lattice& lattice() const noexcept override { return lattice_; }
  float max_key_m(int level) const override;
  std::shared_ptr<const Tile> tile(const TileName& name) const override;
  void prefetch(std::span<const TileName> names) const override;

 private:
  TileName below(const TileName& name) const noexcept;
  std::shared_ptr<const Tile> finer_tile(const TileName& name) const;
  std::shared_ptr<const Tile> displaced_tile(const TileName& name) const;

  std::shared_ptr<const TileSource> dem_;
  std::shared_ptr<const Relief> relief_;
  Lattice lattice_;
  double rounding_m_ = 0;  // of all heights
};

}  // namespace groundray
