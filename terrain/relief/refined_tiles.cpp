#include "terrain/relief/refined_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "terrain/dem/row_major.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray {
namespace {

using passes::rounded_up;

constexpr float infinite_m = std::numeric_limits<float>::infinity();

// Properties of a node that follow from the DEM's surface there.
struct GroundBelow {
  bool exists = false;  // true if some of the node's samples exist
  bool is_missing = false;
  double low_m = infinite_m, high_m = -infinite_m;
};

float lower(double value_m) { return std::nextafter(static_cast<float>(value_m), -infinite_m); }
float higher(double value_m) { return std::nextafter(static_cast<float>(value_m), infinite_m); }

void write_node(Tile& tile, std::size_t at, const GroundBelow& dem, const Relief::Node& relief) {
  if (!dem.exists) return;
  tile.low_m[at] = lower(dem.low_m + relief.low_m);
  tile.high_m[at] = higher(dem.high_m + relief.high_m);
  const double rounding_m = Relief::rounding_m(tile.low_m[at], tile.high_m[at]);
  tile.key_m[at] = dem.is_missing ? passes::mixed_key : rounded_up(relief.key_m + rounding_m);
  tile.deviation_m[at] = rounded_up(relief.deviation_m + rounding_m);
  tile.full_m[at] = rounded_up(relief.full_m + rounding_m);
}

// Fine samples of a cell of the DEM, including those on its sides: columns and rows [first, last].
struct Samples {
  glm::ivec2 first, last;
};

// Records which samples of a cell with missing corners exist. The cell is divided into parts whose
// samples depend on the same corners of it: its corners, its sides and diagonal, and the interiors
// of its halves.
void add_presence(const Cell& cell, int side, const Samples& in, GroundBelow& found) {
  struct Part {
    Samples samples;
    int first_sum, last_sum;  // range of column + row
    double height_m;          // NaN if a corner that it depends on is missing
  };
  const int end = side - 1, all = 2 * side;
  const Part parts[] = {
      {{{0, 0}, {0, 0}}, 0, all, cell.nw},
      {{{side, 0}, {side, 0}}, 0, all, cell.ne},
      {{{0, side}, {0, side}}, 0, all, cell.sw},
      {{{side, side}, {side, side}}, 0, all, cell.se},
      {{{1, 0}, {end, 0}}, 0, all, cell.nw + cell.ne},
      {{{1, side}, {end, side}}, 0, all, cell.sw + cell.se},
      {{{0, 1}, {0, end}}, 0, all, cell.nw + cell.sw},
      {{{side, 1}, {side, end}}, 0, all, cell.ne + cell.se},
      {{{1, 1}, {end, end}}, side, side, cell.ne + cell.sw},
      {{{1, 1}, {end, end}}, 0, side - 1, cell.nw + cell.ne + cell.sw},
      {{{1, 1}, {end, end}}, side + 1, all, cell.se + cell.ne + cell.sw},
  };
  for (const Part& part : parts) {
    const glm::ivec2 low = glm::max(part.samples.first, in.first);
    const glm::ivec2 high = glm::min(part.samples.last, in.last);
    const bool is_in = low.x <= high.x && low.y <= high.y && low.x + low.y <= part.last_sum &&
                       part.first_sum <= high.x + high.y;
    if (is_in) (std::isnan(part.height_m) ? found.is_missing : found.exists) = true;
  }
  for (const double corner_m : {cell.nw, cell.ne, cell.sw, cell.se}) {
    if (std::isnan(corner_m)) continue;
    found.low_m = std::min(found.low_m, corner_m);
    found.high_m = std::max(found.high_m, corner_m);
  }
}

// Adds the heights over `in` of the planes of those halves that overlap it.
void add_heights(const Cell& cell, int side, const Samples& in, GroundBelow& found) {
  found.exists = true;
  const glm::dvec2 low = glm::dvec2(in.first) / static_cast<double>(side);
  const glm::dvec2 high = glm::dvec2(in.last) / static_cast<double>(side);
  const auto add = [&](double start, double slope_x, double slope_y) {
    const glm::dvec2 x = slope_x * glm::dvec2(low.x, high.x);
    const glm::dvec2 y = slope_y * glm::dvec2(low.y, high.y);
    found.low_m = std::min(found.low_m, start + std::min(x[0], x[1]) + std::min(y[0], y[1]));
    found.high_m = std::max(found.high_m, start + std::max(x[0], x[1]) + std::max(y[0], y[1]));
  };
  if (low.x + low.y <= 1) add(cell.nw, cell.ne - cell.nw, cell.sw - cell.nw);
  if (high.x + high.y > 1) add(cell.ne + cell.sw - cell.se, cell.se - cell.sw, cell.se - cell.ne);
}

// Returns properties of the DEM's surface over fine samples [first, last], which lie in one tile of
// its level 0.
GroundBelow ground_below(const Tile& dem, int exponent, glm::ivec2 first, glm::ivec2 last) {
  GroundBelow found;
  const int side = 1 << exponent;
  for (int row = first.y >> exponent; row <= (last.y - 1) >> exponent; ++row) {
    for (int column = first.x >> exponent; column <= (last.x - 1) >> exponent; ++column) {
      const Cell cell = cell_of(dem, {column, row});
      const glm::ivec2 corner = glm::ivec2(column, row) * side;
      const Samples in{glm::max(first - corner, 0), glm::min(last - corner, side)};
      const bool is_whole = !std::isnan(cell.nw + cell.ne + cell.sw + cell.se);
      (is_whole ? add_heights : add_presence)(cell, side, in, found);
    }
  }
  return found;
}

}  // namespace

RefinedTiles::RefinedTiles(std::shared_ptr<const TileSource> dem,
                           std::shared_ptr<const Relief> relief)
    : dem_(std::move(dem)),
      relief_(std::move(relief)),
      lattice_{relief_->frame().samples, dem_->lattice().block_cells} {
  const int top = dem_->lattice().top_level();
  const auto root = dem_->tile({top, {0, 0}});
  const Relief::Node span = relief_->node(relief_->exponent(), {0, 0});
  TrailNodes::Change change;
  if (relief_->trails() != nullptr) {
    trails_.emplace(*dem_, *relief_, lattice_);
    change = trails_->change(lattice_.top_level(), {0, 0});
  }
  rounding_m_ = Relief::rounding_m(
      lower(static_cast<double>(root->low_m[0]) + span.low_m + change.low_m),
      higher(static_cast<double>(root->high_m[0]) + span.high_m + change.high_m));
}

float RefinedTiles::max_key_m(int level) const {
  const int coarser = level - relief_->exponent();
  const double dem_m = coarser < 0 ? 0 : dem_->max_key_m(coarser);
  const double without_m = dem_m + relief_->max_key_m(level) + rounding_m_;
  return trails_ ? trails_->max_key_m(level, without_m) : rounded_up(without_m);
}

// Returns the tile of the DEM from which a tile is computed.
TileName RefinedTiles::below(const TileName& name) const noexcept {
  const int coarser = name.level - relief_->exponent();
  if (coarser >= 0) return {coarser, name.which};
  return {0, {name.which.x >> -coarser, name.which.y >> -coarser}};
}

std::shared_ptr<const Tile> RefinedTiles::tile(const TileName& name) const {
  auto tile = name.level < relief_->exponent() ? finer_tile(name) : displaced_tile(name);
  if (trails_) add_trails(name, *tile);
  return tile;
}

std::shared_ptr<Tile> RefinedTiles::finer_tile(const TileName& name) const {
  auto tile = empty_tile(lattice_, name);
  const TileName from = below(name);
  const std::shared_ptr<const Tile> dem = dem_->tile(from);
  const int exponent = relief_->exponent(), level = name.level;
  const glm::ivec2 last_cell = (from.which + 1) * Tile::cells - 1;  // of the DEM's tile
  for_each_point(lattice_, name, [&](std::size_t at, glm::ivec2 sample) {
    const Cell cell = cell_of(*dem, glm::min(sample >> exponent, last_cell));
    tile->heights_m[at] = relief_->height_m(cell, sample);
  });
  const glm::ivec2 first_node = name.which * Tile::nodes;
  const glm::ivec2 nodes = glm::min(glm::ivec2(Tile::nodes), lattice_.nodes(level) - first_node);
  const int node_cells = lattice_.block_cells << level;
  for (int y = 0; y < nodes.y; ++y) {
    for (int x = 0; x < nodes.x; ++x) {
      const glm::ivec2 node = first_node + glm::ivec2(x, y);
      const glm::ivec2 first = node * node_cells;
      const glm::ivec2 last = glm::min(first + node_cells, lattice_.samples - 1);
      const std::size_t at = value_index({x, y}, Tile::nodes);
      write_node(*tile, at, ground_below(*dem, exponent, first, last), relief_->node(level, node));
      if (level == 0) tile->full_m[at] = 0;  // the reference surface itself
    }
  }
  return tile;
}

std::shared_ptr<Tile> RefinedTiles::displaced_tile(const TileName& name) const {
  auto tile = empty_tile(lattice_, name);
  const TileName from = below(name);
  const std::shared_ptr<const Tile> dem = dem_->tile(from);
  for_each_point(lattice_, name, [&](std::size_t at, glm::ivec2 sample) {
    tile->heights_m[at] = relief_->height_m(static_cast<double>(dem->heights_m[at]), sample);
  });
  Relief::Node span = relief_->node(name.level, {0, 0});
  for (std::size_t at = 0; at < tile->key_m.size(); ++at) {
    const bool exists = dem->key_m[at] >= 0;
    const GroundBelow ground{exists, false, dem->low_m[at], dem->high_m[at]};
    write_node(*tile, at, ground, span);
    if (!exists) continue;
    const double rounding_m = Relief::rounding_m(tile->low_m[at], tile->high_m[at]);
    const auto raised = [&](double dem_m, double relief_m) {
      return rounded_up(dem_m + relief_m + rounding_m);
    };
    tile->key_m[at] = raised(dem->key_m[at], span.key_m);
    tile->deviation_m[at] = raised(dem->deviation_m[at], span.deviation_m);
    tile->full_m[at] = name.level == 0 ? 0 : raised(dem->full_m[at], span.full_m);
  }
  return tile;
}

// Replaces or widens the values of the nodes that trails change.
void RefinedTiles::add_trails(const TileName& name, Tile& tile) const {
  const glm::ivec2 first = name.which * Tile::nodes;
  const glm::ivec2 count = glm::min(glm::ivec2(Tile::nodes), lattice_.nodes(name.level) - first);
  for (int y = 0; y < count.y; ++y) {
    for (int x = 0; x < count.x; ++x) {
      const glm::ivec2 node = first + glm::ivec2(x, y);
      const std::size_t at = value_index({x, y}, Tile::nodes);
      if (name.level < TrailNodes::exact_levels) {
        const auto exact = trails_->node(name.level, node);
        if (!exact) continue;
        tile.key_m[at] = exact->key_m;
        tile.deviation_m[at] = exact->deviation_m;
        tile.full_m[at] = exact->full_m;
        tile.low_m[at] = exact->low_m;
        tile.high_m[at] = exact->high_m;
      } else if (tile.key_m[at] >= 0) {
        const auto [low_m, high_m] = trails_->change(name.level, node);
        for (float* bound_m : {&tile.key_m[at], &tile.deviation_m[at], &tile.full_m[at]})
          *bound_m = rounded_up(*bound_m + (high_m - low_m));
        tile.low_m[at] = lower(tile.low_m[at] + low_m);
        tile.high_m[at] = higher(tile.high_m[at] + high_m);
      }
    }
  }
}

void RefinedTiles::prefetch(std::span<const TileName> names) const {
  std::vector<TileName> wanted;
  for (const TileName& name : names) {
    const TileName from = below(name);
    if (std::ranges::find(wanted, from) == wanted.end()) wanted.push_back(from);
  }
  dem_->prefetch(wanted);
}

}  // namespace groundray
