#include "terrain/relief/trail_nodes.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <glm/common.hpp>
#include <set>

#include "core/error.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/pass.h"
#include "terrain/lod/passes/node_arrays.h"
#include "terrain/trail/trails.h"

namespace groundray {
namespace {

constexpr int top_level = TrailNodes::exact_levels - 1;
constexpr std::size_t most_blocks = 50'000;  // 1.4 GB

// Order of nodes: by row, then by column.
std::pair<int, int> place(glm::ivec2 node) { return {node.y, node.x}; }

// Reads single cells of a DEM from its tiles.
class DemCells {
 public:
  explicit DemCells(const TileSource& dem) : dem_(dem) {}

  Cell at(glm::ivec2 cell) {
    const TileName name{0, cell / Tile::cells};
    if (!tile_ || !(name == name_)) {
      tile_ = dem_.tile(name);
      name_ = name;
    }
    return cell_of(*tile_, cell);
  }

 private:
  const TileSource& dem_;
  std::shared_ptr<const Tile> tile_;
  TileName name_;
};

std::size_t index_in(const NodeLevel& level, glm::ivec2 node) {
  return static_cast<std::size_t>(node.y) * static_cast<std::size_t>(level.size.x) +
         static_cast<std::size_t>(node.x);
}

}  // namespace

TrailNodes::TrailNodes(const TileSource& dem, const Relief& relief, const Lattice& lattice) {
  find_blocks(relief, lattice);
  run_pass(run_in_parallel, blocks_.size(),
           [&](std::size_t i) { certify_block(dem, relief, lattice, blocks_[i]); });
  for (const Block& block : blocks_) {
    for (std::size_t level = 0; level < exact_levels; ++level) {
      for (const float key_m : block.levels[level].key_m) {
        if (std::isfinite(key_m)) max_key_m_[level] = std::max(max_key_m_[level], key_m);
      }
    }
  }
  changes_.emplace_back();
  for (const Block& block : blocks_) changes_.back().emplace_back(block.which, block.change);
  for (int level = top_level + 1; level <= lattice.top_level(); ++level) {
    std::vector<std::pair<glm::ivec2, Change>> coarser;
    for (const auto& [node, change] : changes_.back()) coarser.emplace_back(node / 2, change);
    std::ranges::stable_sort(coarser, {}, [](const auto& entry) { return place(entry.first); });
    std::size_t kept = 0;
    for (const auto& [node, change] : coarser) {
      if (kept > 0 && coarser[kept - 1].first == node) {
        Change& all = coarser[kept - 1].second;
        all = {std::min(all.low_m, change.low_m), std::max(all.high_m, change.high_m)};
      } else {
        coarser[kept++] = {node, change};
      }
    }
    coarser.resize(kept);
    changes_.push_back(std::move(coarser));
  }
}

// Finds the blocks that share a sample with the reach of a trail.
void TrailNodes::find_blocks(const Relief& relief, const Lattice& lattice) {
  const int side = lattice.block_cells << top_level;
  const glm::ivec2 last_block = lattice.nodes(top_level) - 1;
  std::set<std::pair<int, int>> found;
  for (const Trail& trail : relief.trails()->all()) {
    const double reach_m = trail.field().reach_m() + trail.field().line().spacing_m;
    std::pair<glm::ivec2, glm::ivec2> before{{-1, -1}, {-1, -1}};
    for (const glm::dvec2& p : trail.field().line().points_m) {
      const glm::dvec2 a = relief.frame().to_grid(p - reach_m),
                       b = relief.frame().to_grid(p + reach_m);
      // A sample on the border of a block belongs to both.
      const glm::ivec2 first = glm::max(glm::ivec2(glm::floor(glm::min(a, b))) - 1, 0) / side;
      const glm::ivec2 last =
          glm::min(glm::max(glm::ivec2(glm::ceil(glm::max(a, b))) + 1, 0) / side, last_block);
      if (first == before.first && last == before.second) continue;
      before = {first, last};
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) found.emplace(y, x);
      if (found.size() > most_blocks) {
        throw Error(
            "trails: they change more than {} blocks of {} x {} cells; make relief.cell_m larger, "
            "the "
            "trails shorter, or most_bank_m smaller",
            most_blocks, side, side);
      }
    }
  }
  for (const auto& [y, x] : found) blocks_.push_back({.which = {x, y}, .levels = {}, .change = {}});
}

void TrailNodes::certify_block(const TileSource& dem, const Relief& relief, const Lattice& lattice,
                               Block& block) {
  const int side = lattice.block_cells << top_level, exponent = relief.exponent();
  const glm::ivec2 first = block.which * side;
  const glm::ivec2 last = glm::min(first + side, lattice.samples - 1);
  const glm::ivec2 size = last - first + 1, last_cell = ((last - 1) >> exponent);
  std::vector<float> heights_m, points_m;
  DemCells cells(dem);
  for (int row = first.y; row <= last.y; ++row) {
    for (int column = first.x; column <= last.x; ++column) {
      const glm::ivec2 sample(column, row);
      const Cell cell = cells.at(glm::min(sample >> exponent, last_cell));
      heights_m.push_back(relief.height_m(cell, sample));
      const double change_m =
          static_cast<double>(heights_m.back()) - relief.height_without_trails_m(cell, sample);
      if (std::isnan(change_m)) continue;
      block.change = {std::min(block.change.low_m, change_m),
                      std::max(block.change.high_m, change_m)};
    }
  }
  const HeightWindow all{first, size, heights_m.data(), size.x};
  for (int level = 0; level < exact_levels; ++level) {
    const glm::ivec2 first_point = first >> level;
    const glm::ivec2 last_point =
        glm::min(first_point + (side >> level), lattice.points(level) - 1);
    points_m.clear();
    for (int y = first_point.y; y <= last_point.y; ++y) {
      for (int x = first_point.x; x <= last_point.x; ++x) {
        const glm::ivec2 sample = lattice.sample(level, {x, y});
        points_m.push_back(*all.at(sample.x, sample.y));
      }
    }
    const glm::ivec2 count = last_point - first_point + 1;
    const glm::ivec2 first_node = block.which * (1 << (top_level - level));
    NodeLevel& nodes = block.levels[static_cast<std::size_t>(level)];
    nodes = unknown_nodes(
        glm::min(glm::ivec2(1 << (top_level - level)), lattice.nodes(level) - first_node),
        NodeDetail::Full);
    accumulate_deviations(lattice, level, all, {first_point, count, points_m.data(), count.x},
                          first_node, nodes);
    if (level == 0) continue;
    saturate_keys(nodes, first_node, block.levels[static_cast<std::size_t>(level) - 1],
                  2 * first_node);
  }
}

const TrailNodes::Block* TrailNodes::find(glm::ivec2 which) const noexcept {
  const auto at = std::ranges::lower_bound(blocks_, place(which), {},
                                           [](const Block& block) { return place(block.which); });
  return at != blocks_.end() && at->which == which ? &*at : nullptr;
}

std::optional<Relief::Node> TrailNodes::node(int level, glm::ivec2 node) const noexcept {
  const Block* const block = find(node >> (top_level - level));
  if (block == nullptr) return std::nullopt;
  const NodeLevel& nodes = block->levels[static_cast<std::size_t>(level)];
  const std::size_t i = index_in(nodes, node - block->which * (1 << (top_level - level)));
  return Relief::Node{nodes.key_m[i], nodes.deviation_m[i], nodes.full_m[i], nodes.low_m[i],
                      nodes.high_m[i]};
}

TrailNodes::Change TrailNodes::change(int level, glm::ivec2 node) const noexcept {
  const auto& nodes = changes_[static_cast<std::size_t>(std::max(level - top_level, 0))];
  const auto at = std::ranges::lower_bound(nodes, place(node), {},
                                           [](const auto& entry) { return place(entry.first); });
  return at != nodes.end() && at->first == node ? at->second : Change{};
}

float TrailNodes::max_key_m(int level, double without_m) const noexcept {
  if (level < exact_levels)
    return std::max(passes::rounded_up(without_m), max_key_m_[static_cast<std::size_t>(level)]);
  Change all;
  for (const auto& [node, change] : changes_[0])
    all = {std::min(all.low_m, change.low_m), std::max(all.high_m, change.high_m)};
  return passes::rounded_up(without_m + all.high_m - all.low_m);
}

}  // namespace groundray
