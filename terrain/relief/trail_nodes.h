#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "terrain/lod/lattice.h"
#include "terrain/lod/tile_source.h"
#include "terrain/relief/relief.h"

namespace groundray {

/// Certified values of the nodes that trails change (docs/reference/trails.md). The fine lattice is
/// divided into blocks of one node of level `exact_levels - 1`. Blocks within reach of a trail are
/// certified like a DEM; coarser nodes are bounded by the range of the change of their heights.
class TrailNodes {
 public:
  static constexpr int exact_levels = 6;  ///< levels 0 to 5, up to 256 x 256 fine cells

  /// @param dem      tiles of the DEM without relief.
  /// @param lattice  fine lattice of `relief`.
  /// @throws Error if a tile cannot be read.
  TrailNodes(const TileSource& dem, const Relief& relief, const Lattice& lattice);

  /// Returns the values of a node of an exact level; nothing if no trail changes its block.
  std::optional<Relief::Node> node(int level, glm::ivec2 node) const noexcept;

  /// Range of the change of heights by trails; {0, 0} where there is none.
  struct Change {
    double low_m = 0, high_m = 0;
  };
  /// Returns the range over a node, which includes 0.
  Change change(int level, glm::ivec2 node) const noexcept;

  /// Returns an upper bound of the finite keys of a level's nodes.
  /// @param without_m  bound without trails.
  float max_key_m(int level, double without_m) const noexcept;

 private:
  struct Block {
    glm::ivec2 which{0};
    std::array<NodeLevel, exact_levels> levels;
    Change change;
  };
  void find_blocks(const Relief& relief, const Lattice& lattice);
  static void certify_block(const TileSource& dem, const Relief& relief, const Lattice& lattice,
                            Block& block);
  const Block* find(glm::ivec2 which) const noexcept;

  std::vector<Block> blocks_;  // by row, then column
  /// Changes of nodes, by level from exact_levels - 1 on, in the same order.
  std::vector<std::vector<std::pair<glm::ivec2, Change>>> changes_;
  std::array<float, exact_levels> max_key_m_{};
};

}  // namespace groundray
