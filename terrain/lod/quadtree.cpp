#include "terrain/lod/quadtree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <memory>
#include <utility>

#include "core/error.h"
#include "terrain/dem/row_major.h"
#include "terrain/lod/passes/leaf_list.h"
#include "terrain/lod/passes/selection.h"
#include "terrain/lod/prefix_sum.h"

namespace groundray {
namespace {

using passes::BoundTest;
using passes::ListedNodes;
using passes::NodeRuns;
using passes::StateWindow;
using passes::WindowOverlap;

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

bool is_empty(const NodeWindow& window) { return window.size.x <= 0 || window.size.y <= 0; }

[[maybe_unused]] bool is_well_placed(const Lattice& lattice, std::span<const NodeWindow> windows,
                                     std::size_t level) {
  const NodeWindow& window = windows[level];
  if (is_empty(window)) return level == 0 || is_empty(windows[level - 1]);
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

// Returns how the nodes of a level overlap the window of a finer one.
WindowOverlap overlap(const Lattice& lattice, const NodeWindow& window, int finer, int level) {
  const int shift = level - finer;
  const glm::ivec2 rounding((1 << shift) - 1);
  const glm::ivec2 end = window.first + window.size;
  const glm::ivec2 meets_end = (end + rounding) >> shift;
  const glm::ivec2 all = lattice.nodes(finer);
  return {{window.first >> shift, meets_end},
          {(window.first + rounding) >> shift,
           {end.x == all.x ? meets_end.x : end.x >> shift,
            end.y == all.y ? meets_end.y : end.y >> shift}}};
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
    for (int finer = level - 2; finer >= 0; --finer) {
      const NodeWindow& window = windows[static_cast<std::size_t>(finer)];
      if (is_empty(window)) break;
      if (window.size != lattice.nodes(finer))
        pass.finer[pass.finer_count++] = overlap(lattice, window, finer, level);
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
};

// Returns the nodes of a level that lie in a window but not in that of the next finer level.
ListedNodes listed_nodes(const Selection& selection, std::span<const NodeWindow> windows,
                         int window_level, int level, int run_nodes) {
  const auto at = static_cast<std::size_t>(level);
  const glm::ivec2 first = windows[at].first;
  const auto inside = [&](int finer) -> Rectangle {
    if (finer < 0 || is_empty(windows[static_cast<std::size_t>(finer)])) return {};
    const Rectangle nodes =
        overlap(selection.lattice, windows[static_cast<std::size_t>(finer)], finer, level).inside;
    return {nodes.first - first, nodes.end - first};
  };
  const Rectangle listed = inside(window_level);
  return {{glm::max(listed.end - listed.first, 0), run_nodes},
          listed.first,
          inside(window_level - 1),
          windows[at],
          selection.levels[at].state.data()};
}

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
                              int window_level, const PassRunner& runner) {
  std::vector<ListedNodes> levels;
  std::vector<std::size_t> first_run{0};
  for (int level = window_level; level <= selection.lattice.top_level(); ++level) {
    levels.push_back(listed_nodes(selection, windows, window_level, level, runner.run_nodes));
    first_run.push_back(first_run.back() + levels.back().runs.count());
  }
  const auto offsets = std::make_unique_for_overwrite<std::uint32_t[]>(first_run.back());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    run_pass(runner, levels[i].runs.count(),
             passes::CountLeavesPass{levels[i], offsets.get() + first_run[i]});
  }
  std::vector<Leaf> leaves(sum_up(offsets.get(), first_run.back(), runner));
  for (std::size_t i = 0; i < levels.size(); ++i) {
    run_pass(runner, levels[i].runs.count(),
             passes::ListLeavesPass{levels[i], offsets.get() + first_run[i],
                                    window_level + static_cast<int>(i),
                                    selection.lattice.block_cells, leaves.data()});
  }
  return leaves;
}

}  // namespace groundray
