#pragma once

#include <cstddef>
#include <cstdint>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray::passes {

/// Counts the leaves in each run of a level, except those without any height.
struct CountLeavesPass {
  static constexpr char name[] = "CountLeavesPass";

  NodeRuns runs;
  const std::uint8_t* states;
  const float* key_m;
  std::uint32_t* counts;

  static bool is_listed(std::uint8_t state, float key_m) noexcept {
    return (state & NodeState::IsLeaf) != 0 && key_m >= 0;
  }

  void operator()(std::size_t index) const noexcept {
    const NodeRuns::Run run = runs.at(index);
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(run.row) * runs.size.x;
    counts[index] = 0;
    if (!any_has(states + row + run.begin, run.end - run.begin, NodeState::IsLeaf)) return;
    std::uint32_t count = 0;
    for (int x = run.begin; x < run.end; ++x) {
      count += is_listed(states[row + x], key_m[row + x]) ? 1 : 0;
    }
    counts[index] = count;
  }
};

/// Lists the leaves in each run of a level.
struct ListLeavesPass {
  static constexpr char name[] = "ListLeavesPass";

  NodeRuns runs;
  NodeWindow nodes;
  const std::uint8_t* states;
  const std::uint32_t* offsets;  ///< index of each run's first leaf in the list
  int level = 0;
  int block_cells = 2;
  Leaf* leaves;

  void operator()(std::size_t index) const noexcept {
    const NodeRuns::Run run = runs.at(index);
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(run.row) * runs.size.x;
    if (!any_has(states + row + run.begin, run.end - run.begin, NodeState::IsLeaf)) return;
    Leaf* out = leaves + offsets[index];
    for (int x = run.begin; x < run.end; ++x) {
      const std::uint8_t state = states[row + x];
      if (!CountLeavesPass::is_listed(state, nodes.key_m[row + x])) continue;
      const auto sides = static_cast<std::uint8_t>(state & NodeState::AllSides);
      const float* const deviations = sides == 0 ? nodes.full_m : nodes.deviation_m;
      *out++ = {((nodes.first.x + x) * block_cells) << level,
                ((nodes.first.y + run.row) * block_cells) << level,
                1 << level,
                sides,
                (state & NodeState::Holed) != 0,
                deviations == nullptr ? 0 : deviations[row + x],
                nodes.high_m == nullptr ? 0 : nodes.high_m[row + x]};
    }
  }
};

}  // namespace groundray::passes
