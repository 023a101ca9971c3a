#include "terrain/lod/quadtree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <utility>

#include "core/error.h"
#include "terrain/dem/row_major.h"
#include "terrain/lod/passes/leaf_list.h"
#include "terrain/lod/passes/selection.h"

namespace groundray {
namespace {

using passes::BoundTest;
using passes::NodeRuns;
using passes::StateWindow;
using passes::WindowSpan;

void check_mesh_bound(const MeshBound& bound) {
  Violations broken("mesh bound");
  broken.unless(bound.tolerance_m >= 0, "tolerance_m = {} must be 0 or more", bound.tolerance_m);
  for (int axis = 0; axis < 3; ++axis) {
    broken.unless(std::isfinite(bound.low_m[axis]) && std::isfinite(bound.high_m[axis]),
                  "the viewpoint, [{}, {}] m along axis {}, must be finite", bound.low_m[axis],
                  bound.high_m[axis], axis);
  }
  broken.unless(bound.angle_rad >= 0 && std::isfinite(bound.angle_rad),
                "angle_rad = {} must be 0 or more, and finite", bound.angle_rad);
  broken.throw_if_any();
}

[[maybe_unused]] bool is_well_placed(const Lattice& lattice, std::span<const NodeWindow> windows,
                                     std::size_t level) {
  const NodeWindow& window = windows[level];
  if (window.size.x <= 0 || window.size.y <= 0) return level == 0 || windows[level - 1].size.x <= 0;
  const glm::ivec2 all = lattice.nodes(static_cast<int>(level));
  const glm::ivec2 end = window.first + window.size;
  if (level + 1 == windows.size()) return window.first == glm::ivec2(0) && window.size == all;
  const NodeWindow& above = windows[level + 1];
  const auto is_well_placed_along = [&](int axis) {
    const bool even = window.first[axis] % 2 == 0 &&
                      (end[axis] % 2 == 0 || end[axis] == all[axis]) && end[axis] <= all[axis];
    const bool below_first = window.first[axis] == 0 || window.first[axis] / 2 > above.first[axis];
    const bool below_end =
        end[axis] == all[axis] || end[axis] / 2 < above.first[axis] + above.size[axis];
    return even && below_first && below_end;
  };
  return is_well_placed_along(0) && is_well_placed_along(1);
}

// Returns how the columns (axis 0) or rows (axis 1) of a level's window overlap the windows of
// finer levels.
std::vector<WindowSpan> spans(const Lattice& lattice, std::span<const NodeWindow> windows,
                              int level, int axis) {
  const NodeWindow& window = windows[static_cast<std::size_t>(level)];
  std::vector<WindowSpan> spans(static_cast<std::size_t>(window.size[axis]));
  for (int finer = 0; finer + 1 < level; ++finer) {
    const NodeWindow& other = windows[static_cast<std::size_t>(finer)];
    if (other.size.x <= 0 || other.size.y <= 0) continue;
    const int begin = other.first[axis];
    const int end = begin + other.size[axis];
    const int all = lattice.nodes(finer)[axis];
    for (std::size_t i = 0; i < spans.size(); ++i) {
      const int node = window.first[axis] + static_cast<int>(i);
      const int first = node << (level - finer);
      const int last = std::min((node + 1) << (level - finer), all);
      const std::uint32_t bit = 1U << finer;
      if (first < end && last > begin) spans[i].meets |= bit;
      if (first >= begin && last <= end) spans[i].inside |= bit;
    }
  }
  return spans;
}

bool is_whole(const Lattice& lattice, const NodeWindow& window, int level) {
  return window.size == lattice.nodes(level);
}

StateWindow state_window(Selection::Level& level) {
  return {level.first, level.size, level.state.data()};
}

struct Splitter {
  const Lattice& lattice;
  std::span<const NodeWindow> windows;
  const MeshBound& bound;
  const PassRunner& runner;

  void split(Selection& selection, int level) const {
    const auto at = static_cast<std::size_t>(level);
    const NodeRuns runs{windows[at].size, runner.run_nodes};
    const auto [low_m, high_m] = sensor_box(level);
    BoundTest test{bound.tolerance_m,
                   bound.angle_rad * bound.angle_rad,
                   low_m,
                   high_m,
                   bound.cell_m,
                   level,
                   lattice.block_cells,
                   lattice.samples - 1};
    passes::SplitPass pass{runs, windows[at], state_window(selection.levels[at]), {}, test};
    if (level > 0) pass.children = state_window(selection.levels[at - 1]);
    std::vector<WindowSpan> columns;
    std::vector<WindowSpan> rows;
    if (!finer_are_whole(level)) {
      columns = spans(lattice, windows, level, 0);
      rows = spans(lattice, windows, level, 1);
      pass.columns = columns.data();
      pass.rows = rows.data();
    }
    run_pass(runner, runs.count(), pass);
  }

  // Returns the box of the sensors' positions for one level. Boxes of coarser levels contain those
  // of finer ones, so that bounds stay nested.
  std::pair<glm::dvec3, glm::dvec3> sensor_box(int level) const {
    if (bound.widened_to_nodes == 0) return {bound.low_m, bound.high_m};
    const double cells = std::ldexp(bound.widened_to_nodes * lattice.block_cells, level);
    const glm::dvec3 unit_m(bound.cell_m * cells, std::min(bound.cell_m.x, bound.cell_m.y) * cells);
    return {glm::floor(bound.low_m / unit_m) * unit_m, glm::ceil(bound.high_m / unit_m) * unit_m};
  }

  bool finer_are_whole(int level) const {
    for (int finer = 0; finer + 1 < level; ++finer) {
      if (!is_whole(lattice, windows[static_cast<std::size_t>(finer)], finer)) return false;
    }
    return true;
  }
};

}  // namespace

NodeWindow whole_window(const NodeLevel& level) {
  const auto pointer = [](const std::vector<float>& values) {
    return values.empty() ? nullptr : values.data();
  };
  return {{0, 0},
          level.size,
          pointer(level.key_m),
          pointer(level.low_m),
          pointer(level.high_m),
          pointer(level.deviation_m),
          pointer(level.full_m)};
}

Selection select_nodes(const Lattice& lattice, std::span<const NodeWindow> windows,
                       const MeshBound& bound, const PassRunner& runner) {
  check_mesh_bound(bound);
  assert(windows.size() == static_cast<std::size_t>(lattice.top_level()) + 1);
  Selection selection{lattice, {}};
  for (std::size_t level = 0; level < windows.size(); ++level) {
    assert(is_well_placed(lattice, windows, level));
    const NodeWindow& window = windows[level];
    selection.levels.push_back({window.first, window.size, {}});
    selection.levels.back().state.resize(value_count(window.size));
  }
  const Splitter splitter{lattice, windows, bound, runner};
  const int top = lattice.top_level();
  for (int level = 0; level <= top; ++level) splitter.split(selection, level);
  for (int level = 0; level <= top; ++level) {
    const auto at = static_cast<std::size_t>(level);
    const NodeRuns runs{windows[at].size, runner.run_nodes};
    passes::LeafPass pass{runs, state_window(selection.levels[at]), {}, lattice.nodes(level)};
    if (level < top) pass.parents = state_window(selection.levels[at + 1]);
    run_pass(runner, runs.count(), pass);
  }
  return selection;
}

std::vector<Leaf> list_leaves(const Selection& selection, std::span<const NodeWindow> windows,
                              int first_level, int last_level, const PassRunner& runner) {
  std::vector<std::vector<std::uint32_t>> offsets;
  std::uint32_t total = 0;
  for (int level = first_level; level <= last_level; ++level) {
    const auto at = static_cast<std::size_t>(level);
    const NodeRuns runs{windows[at].size, runner.run_nodes};
    auto& counts = offsets.emplace_back(runs.count());
    run_pass(runner, runs.count(),
             passes::CountLeavesPass{runs, selection.levels[at].state.data(), windows[at].key_m,
                                     counts.data()});
    for (std::uint32_t& count : counts) total += std::exchange(count, total);
  }
  std::vector<Leaf> leaves(total);
  for (int level = first_level; level <= last_level; ++level) {
    const auto at = static_cast<std::size_t>(level);
    const NodeRuns runs{windows[at].size, runner.run_nodes};
    run_pass(runner, runs.count(),
             passes::ListLeavesPass{runs, windows[at], selection.levels[at].state.data(),
                                    offsets[static_cast<std::size_t>(level - first_level)].data(),
                                    level, selection.lattice.block_cells, leaves.data()});
  }
  return leaves;
}

}  // namespace groundray
