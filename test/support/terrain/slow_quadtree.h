#pragma once

#include <algorithm>
#include <compare>
#include <glm/vec2.hpp>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/quadtree.h"
#include "test/support/terrain/node_oracle.h"

namespace groundray::testing {

/// A node of a quadtree: its level, and its position on that level.
struct Node {
  int level, column, row;
  friend auto operator<=>(const Node&, const Node&) = default;
};

/// A certificate that is visible only through windows: initially all of each level.
struct Known {
  Lattice lattice;
  std::vector<NodeLevel> levels;
  std::vector<NodeLevel> shown;  ///< storage that the windows refer to
  std::vector<NodeWindow> windows;

  Known(const HeightGrid& grid, int block_cells)
      : lattice{{grid.columns(), grid.rows()}, block_cells},
        levels(certify(grid, block_cells, NodeDetail::Full)),
        shown(levels) {
    for (const NodeLevel& level : levels) windows.push_back(whole_window(level));
  }
  Known(const Known&) = delete;

  /// Shows only nodes [first, end) of a level.
  void show(int level, glm::ivec2 first, glm::ivec2 end);
  /// Shows nested windows round a position (samples), `side` nodes wide (a multiple of 4); the
  /// coarse levels that fit into one window stay whole.
  void show_windows_round(glm::dvec2 place, int side);
  std::size_t index(const Node& node) const {
    return std::size_t(node.row) * std::size_t(levels[std::size_t(node.level)].size.x) +
           std::size_t(node.column);
  }
  const NodeLevel& of(const Node& node) const { return levels[std::size_t(node.level)]; }
};

/// Returns max(tolerance, angle * distance) for a node, metres.
Real bound_of(const Known& known, const MeshBound& bound, const Node& node);

/// Reference implementation of the quadtree specified by select_nodes, directly from its rules: a
/// set of leaves, split one by one until no rule requires another split.
class SlowQuadtree {
 public:
  SlowQuadtree(const Known& known, const MeshBound& bound);
  const std::set<Node>& leaves() const { return leaves_; }
  /// Returns the level of the leaf at a cell of the DEM.
  int level_at(glm::ivec2 cell) const { return level_.at({cell.x, cell.y}); }

 private:
  struct Rectangle {
    glm::ivec2 first, end;  // cells of the DEM
  };
  Rectangle cells(const Node& node) const;
  void add(const Node& node);
  void split(const Node& node);
  bool can_split(const Node& node) const;
  bool exceeds(const Node& node) const;
  bool must_split(const Node& node) const;
  bool straddles_a_window(const Node& node) const;
  bool has_too_fine_a_neighbour(const Node& node) const;

  const Known& known_;
  const MeshBound& bound_;
  std::set<Node> leaves_;
  std::map<std::pair<int, int>, int> level_;  // level of the leaf at each cell of the DEM
};

}  // namespace groundray::testing
