#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray::passes {

/// Test of a node against its bound, without division or square root. It is monotone: if a node
/// exceeds its bound, so does its parent.
struct BoundTest {
  double tolerance_m = 0;
  double angle_squared = 0;
  glm::dvec3 low_m{0}, high_m{0};  ///< bounding box of the sensors' positions
  glm::dvec2 cell_m{1};
  int level = 0;
  int block_cells = 2;
  glm::ivec2 last_sample{1};

  static double gap(double low, double high, double other_low, double other_high) noexcept {
    return std::max({0.0, other_low - high, low - other_high});
  }
  /// Returns whether node `at` of a window exceeds its bound; `node` is its position on its level.
  bool exceeds(const NodeWindow& nodes, std::ptrdiff_t at, glm::ivec2 node) const noexcept {
    const double key = nodes.key_m[at];
    if (key == std::numeric_limits<double>::infinity()) return true;  // has holes
    if (!(key > tolerance_m)) return false;
    if (angle_squared == 0) return true;
    const double x =
        gap(first_m(node.x, cell_m.x), last_m(node.x, last_sample.x, cell_m.x), low_m.x, high_m.x);
    const double y =
        gap(first_m(node.y, cell_m.y), last_m(node.y, last_sample.y, cell_m.y), low_m.y, high_m.y);
    const double z = gap(nodes.low_m[at], nodes.high_m[at], low_m.z, high_m.z);
    return key * key > angle_squared * (x * x + y * y + z * z);
  }

 private:
  double first_m(int node, double cell) const noexcept {
    return static_cast<double>(static_cast<std::int64_t>(node) * block_cells << level) * cell;
  }
  double last_m(int node, int last, double cell) const noexcept {
    const std::int64_t end = (static_cast<std::int64_t>(node) + 1) * block_cells << level;
    return static_cast<double>(std::min<std::int64_t>(end, last)) * cell;
  }
};

/// Nodes of a level that overlap the window of a finer level, and those of them that lie in it. The
/// others straddle it.
struct WindowOverlap {
  Rectangle meets, inside;
};

/// Determines which nodes of one level are split; requires the level below to be done.
struct SplitPass {
  static constexpr char name[] = "SplitPass";

  NodeRuns runs;
  NodeWindow nodes;
  StateWindow states;
  StateWindow children;  ///< empty if no node of the level can be split
  BoundTest bound;
  int finer_count = 0;                       ///< windows that nodes may straddle
  WindowOverlap finer[Lattice::max_levels];  ///< each lies in the one before

  void operator()(std::size_t index) const noexcept {
    const NodeRuns::Run run = runs.at(index);
    std::uint8_t* const out = states.row(run.row);
    if (stays_whole(run)) return std::fill(out + run.begin, out + run.end, std::uint8_t{0});
    for (int x = run.begin; x < run.end; ++x) {
      const glm::ivec2 node = nodes.first + glm::ivec2{x, run.row};
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(run.row) * nodes.size.x + x;
      const float key_m = nodes.key_m[at];
      const bool is_holed = !(key_m >= 0 && key_m < std::numeric_limits<float>::infinity());
      const bool exceeds = bound.exceeds(nodes, at, node);
      const bool splits =
          can_split(node) && (exceeds || straddles(node) || children_ask_for_it(node));
      out[x] = static_cast<std::uint8_t>((splits    ? NodeState::Split
                                          : exceeds ? NodeState::Tight
                                                    : 0) |
                                         (is_holed ? NodeState::Holed : 0));
    }
  }

 private:
  /// Returns whether no node of the run has a reason to be split, as in most runs of fine levels.
  bool stays_whole(const NodeRuns::Run& run) const noexcept {
    const float* const key_m = nodes.key_m + static_cast<std::ptrdiff_t>(run.row) * nodes.size.x;
    const auto tolerance_m = static_cast<float>(bound.tolerance_m);
    bool is_reason = false;
    for (int x = run.begin; x < run.end; ++x) {
      is_reason |= !(key_m[x] >= 0 && key_m[x] < tolerance_m);
    }
    if (is_reason || finer_count > 0) return false;
    const int first = nodes.first.x + run.begin;
    const int last = nodes.first.x + run.end;
    const int row = nodes.first.y + run.row;
    return !children.any_has(2 * first - 1, 2 * last + 1, 2 * row - 1, 2 * row + 2,
                             NodeState::Split | NodeState::Tight);
  }

  bool can_split(glm::ivec2 node) const noexcept {
    const int x = 2 * node.x - children.first.x;
    const int y = 2 * node.y - children.first.y;
    return x >= 0 && y >= 0 && x < children.size.x && y < children.size.y;
  }

  bool straddles(glm::ivec2 node) const noexcept {
    for (int i = 0; i < finer_count && finer[i].meets.holds(node); ++i) {
      if (!finer[i].inside.holds(node)) return true;
    }
    return false;
  }

  /// Returns whether a child is split, or a neighbour's child at the node's side is split or must
  /// not be thinned.
  bool children_ask_for_it(glm::ivec2 node) const noexcept {
    const int x = 2 * node.x - children.first.x;
    const int y = 2 * node.y - children.first.y;
    const int own = get(x, y) | get(x + 1, y) | get(x, y + 1) | get(x + 1, y + 1);
    const int others = get(x, y - 1) | get(x + 1, y - 1) | get(x, y + 2) | get(x + 1, y + 2) |
                       get(x - 1, y) | get(x - 1, y + 1) | get(x + 2, y) | get(x + 2, y + 1);
    return ((own & NodeState::Split) | (others & (NodeState::Split | NodeState::Tight))) != 0;
  }
  int get(int x, int y) const noexcept {
    return x < 0 || y < 0 || x >= children.size.x || y >= children.size.y ? 0 : children.row(y)[x];
  }
};

/// Determines the leaves of one level and their thinned sides; requires the splits of all levels.
struct LeafPass {
  static constexpr char name[] = "LeafPass";

  NodeRuns runs;
  StateWindow states;
  StateWindow parents;   ///< empty at the top level
  glm::ivec2 all_nodes;  ///< number of nodes of the level

  void operator()(std::size_t index) const noexcept {
    const NodeRuns::Run run = runs.at(index);
    std::uint8_t* const out = states.row(run.row);
    const int row = states.first.y + run.row;
    if (!any_exists(states.first.x + run.begin, states.first.x + run.end, row)) return;
    for (int x = run.begin; x < run.end; ++x) {
      const int column = states.first.x + x;
      if ((out[x] & NodeState::Split) != 0 || !exists(column, row)) continue;
      const bool north = row > 0 && !exists(column, row - 1);
      const bool south = row + 1 < all_nodes.y && !exists(column, row + 1);
      const bool west = column > 0 && !exists(column - 1, row);
      const bool east = column + 1 < all_nodes.x && !exists(column + 1, row);
      out[x] = static_cast<std::uint8_t>(out[x] | NodeState::IsLeaf | (north ? Leaf::North : 0) |
                                         (east ? Leaf::East : 0) | (south ? Leaf::South : 0) |
                                         (west ? Leaf::West : 0));
    }
  }

 private:
  bool exists(int column, int row) const noexcept {
    return parents.state == nullptr || (parents.at(column / 2, row / 2) & NodeState::Split) != 0;
  }
  bool any_exists(int begin, int end, int row) const noexcept {
    return parents.state == nullptr ||
           parents.any_has(begin / 2, (end + 1) / 2, row / 2, row / 2, NodeState::Split);
  }
};

}  // namespace groundray::passes
