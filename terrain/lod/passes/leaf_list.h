#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray::passes {

/// Nodes of one level whose leaves are listed, except those without any height.
struct ListedNodes {
  NodeRuns runs;        ///< of a rectangle of nodes in the window
  glm::ivec2 first{0};  ///< node of the rectangle, relative to the window's
  Rectangle omitted;    ///< nodes of the window that are not listed, likewise
  NodeWindow nodes;
  const std::uint8_t* states;

  /// Calls `act` with the position in the window of each listed leaf of a run, and its index.
  template <typename Act>
  void for_each_leaf(std::size_t index, const Act& act) const noexcept {
    const NodeRuns::Run run = runs.at(index);
    const int row = first.y + run.row;
    const std::ptrdiff_t start = static_cast<std::ptrdiff_t>(row) * nodes.size.x;
    const int begin = first.x + run.begin;
    const int end = first.x + run.end;
    if (!any_has(states + start + begin, end - begin, NodeState::IsLeaf)) return;
    const bool omits = omitted.first.y <= row && row < omitted.end.y;
    const int omitted_begin = omits ? omitted.first.x : end;
    const int omitted_end = omits ? omitted.end.x : end;
    for (int x = begin; x < end; ++x) {
      // Without branches, so that counting is vectorized.
      const bool is_listed = ((states[start + x] & NodeState::IsLeaf) != 0) &
                             (nodes.key_m[start + x] >= 0) &
                             ((x < omitted_begin) | (x >= omitted_end));
      if (is_listed) act(glm::ivec2{x, row}, start + x);
    }
  }
};

/// Counts the leaves in each run of a level.
struct CountLeavesPass {
  static constexpr char name[] = "CountLeavesPass";

  ListedNodes listed;
  std::uint32_t* counts;

  void operator()(std::size_t index) const noexcept {
    std::uint32_t count = 0;
    listed.for_each_leaf(index, [&](glm::ivec2, std::ptrdiff_t) { ++count; });
    counts[index] = count;
  }
};

/// Lists the leaves in each run of a level.
struct ListLeavesPass {
  static constexpr char name[] = "ListLeavesPass";

  ListedNodes listed;
  const std::uint32_t* offsets;  ///< index of each run's first leaf in the list
  int level = 0;
  int block_cells = 2;
  Leaf* leaves;

  void operator()(std::size_t index) const noexcept {
    const NodeWindow& nodes = listed.nodes;
    Leaf* out = leaves + offsets[index];
    listed.for_each_leaf(index, [&](glm::ivec2 at, std::ptrdiff_t node) {
      const std::uint8_t state = listed.states[node];
      const auto sides = static_cast<std::uint8_t>(state & NodeState::AllSides);
      const float* const deviations = sides == 0 ? nodes.full_m : nodes.deviation_m;
      *out++ = {((nodes.first.x + at.x) * block_cells) << level,
                ((nodes.first.y + at.y) * block_cells) << level,
                1 << level,
                sides,
                (state & NodeState::Holed) != 0,
                deviations == nullptr ? 0 : deviations[node],
                nodes.high_m == nullptr ? 0 : nodes.high_m[node]};
    });
  }
};

}  // namespace groundray::passes
