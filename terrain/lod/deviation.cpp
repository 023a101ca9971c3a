#include "terrain/lod/deviation.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "core/error.h"
#include "terrain/lod/passes/deviation.h"

namespace groundray {
namespace {

using passes::CellShape;
using passes::DeviationPass;
using passes::LevelGrid;
using passes::NodeArrays;
using passes::Points;

CellShape shape_of(int width, int height, int step) {
  return {width,
          height,
          width == step && height == step,
          1.0 / width,
          1.0 / height,
          1.0 / (static_cast<double>(width) * height),
          1.0 / (static_cast<double>(width) + height),
          width == height ? 0 : 1.0 / std::abs(width - height)};
}

LevelGrid grid_of(const Lattice& lattice, int level) {
  const int step = 1 << level;
  const glm::ivec2 cells = lattice.cells(level);
  const glm::ivec2 last = lattice.samples - 1 - (cells - 1) * step;
  return {level,
          lattice.block_cells,
          cells,
          {{shape_of(step, step, step), shape_of(step, last.y, step)},
           {shape_of(last.x, step, step), shape_of(last.x, last.y, step)}},
          1.0 / (glm::dvec2(step) + glm::dvec2(last))};
}

NodeArrays arrays_of(NodeLevel& level, glm::ivec2 first) {
  const auto pointer = [](std::vector<float>& values) {
    return values.empty() ? nullptr : values.data();
  };
  return {first,
          level.size,
          1,
          pointer(level.key_m),
          pointer(level.deviation_m),
          pointer(level.full_m),
          pointer(level.low_m),
          pointer(level.high_m)};
}

// Large enough to be worth a task, small enough to keep all threads busy.
constexpr std::int64_t samples_of_a_part = 1 << 16;

// Divides the nodes into runs, or each node into bands.
void cut(DeviationPass& pass, int run_samples) {
  const std::int64_t side = std::int64_t{pass.grid.block_cells} << pass.grid.level;
  const std::int64_t width = std::min<std::int64_t>(side, pass.samples.size.x);
  const std::int64_t height = std::min<std::int64_t>(side + 1, pass.samples.size.y);
  if (pass.grid.level == 0 || width * height <= 2 * samples_of_a_part) {
    pass.run = static_cast<int>(std::max<std::int64_t>(1, run_samples / side));
    return;
  }
  pass.part_rows = static_cast<int>(std::max<std::int64_t>(1, samples_of_a_part / width));
  pass.parts = static_cast<int>((height + pass.part_rows - 1) / pass.part_rows);
}

void run(DeviationPass& pass, const PassRunner& runner) {
  cut(pass, runner.run_samples);
  if (pass.parts == 1) return run_pass(runner, pass.count(), pass);
  const NodeArrays nodes = pass.nodes;
  std::vector<float> full(pass.count(), 0);
  std::vector<float> deviation(pass.count(), 0);
  pass.nodes = {.first = pass.touched.first,
                .size = pass.touched.end - pass.touched.first,
                .parts = pass.parts,
                .deviation_m = deviation.data(),
                .full_m = full.data()};
  run_pass(runner, pass.count(), pass);
  run_pass(runner, pass.count() / static_cast<std::size_t>(pass.parts),
           passes::JoinPartsPass{pass.nodes, nodes});
}

void accumulate(const Lattice& lattice, int level, const HeightWindow& samples,
                const Points& points, NodeArrays nodes, const PassRunner& runner) {
  const auto node_at = [&](int sample) { return (sample >> level) / lattice.block_cells; };
  const glm::ivec2 last = samples.first + samples.size - 2;  // last cell of the DEM in the window
  DeviationPass pass{samples, points, grid_of(lattice, level)};
  pass.touched = {{node_at(samples.first.x), node_at(samples.first.y)},
                  {node_at(last.x) + 1, node_at(last.y) + 1}};
  pass.nodes = nodes;
  run(pass, runner);
}

}  // namespace

NodeLevel unknown_nodes(glm::ivec2 size, NodeDetail detail) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const std::size_t count = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  NodeLevel level{size, std::vector<float>(count, passes::unknown_key), {}, {}, {}, {}};
  if (detail == NodeDetail::KeysOnly) return level;
  level.deviation_m.assign(count, 0);
  level.full_m.assign(count, 0);
  level.low_m.assign(count, infinity);
  level.high_m.assign(count, -infinity);
  return level;
}

void accumulate_deviations(const Lattice& lattice, int level, const HeightWindow& samples,
                           const HeightWindow& points, glm::ivec2 first_node, NodeLevel& nodes,
                           const PassRunner& runner) {
  accumulate(lattice, level, samples, {points}, arrays_of(nodes, first_node), runner);
}

void saturate_keys(NodeLevel& nodes, glm::ivec2 first_node, const NodeLevel& children,
                   glm::ivec2 first_child, const PassRunner& runner) {
  // The pass only reads the children.
  auto& readable = const_cast<NodeLevel&>(children);
  const passes::NodeRuns runs{nodes.size, runner.run_nodes};
  run_pass(
      runner, runs.count(),
      passes::SaturatePass{runs, arrays_of(nodes, first_node), arrays_of(readable, first_child)});
}

std::vector<NodeLevel> certify(const HeightGrid& grid, int block_cells, NodeDetail detail,
                               const PassRunner& runner) {
  if (block_cells < 2 || block_cells > Lattice::max_block_cells || block_cells % 2 != 0) {
    throw Error("quadtree: block_cells = {} must be even, from 2 to {}", block_cells,
                Lattice::max_block_cells);
  }
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  const HeightWindow samples{{0, 0}, lattice.samples, grid.heights_m().data(), grid.columns()};
  std::vector<NodeLevel> levels;
  for (int level = 0; level <= lattice.top_level(); ++level) {
    levels.push_back(unknown_nodes(lattice.nodes(level), detail));
    accumulate(lattice, level, samples, {samples, level, lattice.samples - 1},
               arrays_of(levels.back(), {0, 0}), runner);
    if (level > 0) {
      saturate_keys(levels.back(), {0, 0}, levels[static_cast<std::size_t>(level) - 1], {0, 0},
                    runner);
    }
  }
  return levels;
}

}  // namespace groundray
