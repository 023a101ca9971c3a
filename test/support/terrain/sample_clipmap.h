#pragma once

#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "terrain/lod/clipmap.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/tile_source.h"

namespace groundray::testing {

/// The certified grid as a source of tiles.
inline std::shared_ptr<const MemoryTiles> certified_tiles(const HeightGrid& grid) {
  return std::make_shared<const MemoryTiles>(
      grid, certify(grid, Certificate::block_cells, NodeDetail::Full));
}

/// A source that counts requests and throws at request number `fails_at`.
class FailingTiles final : public TileSource {
 public:
  explicit FailingTiles(std::shared_ptr<const TileSource> inner) : inner_(std::move(inner)) {}

  const Lattice& lattice() const noexcept override { return inner_->lattice(); }
  float max_key_m(int level) const override { return inner_->max_key_m(level); }
  std::shared_ptr<const Tile> tile(const TileName& name) const override {
    ++asked;
    if (asked == fails_at)
      throw Error("level {}: tile ({}, {}) cannot be read", name.level, name.which.x, name.which.y);
    return inner_->tile(name);
  }

  mutable std::size_t asked = 0;
  mutable std::optional<std::size_t> fails_at;

 private:
  std::shared_ptr<const TileSource> inner_;
};

/// A sensor at a single point.
inline SensorBox sensor_at(const glm::dvec3& p_m) { return {p_m, p_m}; }

}  // namespace groundray::testing
