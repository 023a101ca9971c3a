#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/vec2.hpp>
#include <limits>

#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/fine_deviation.h"
#include "terrain/lod/passes/level_grid.h"
#include "terrain/lod/passes/node_arrays.h"
#include "terrain/lod/passes/node_deviation.h"
#include "terrain/lod/passes/regular_deviation.h"

namespace groundray::passes {

/// Deviations of the nodes of one level, as far as a window of samples shows them. An index is a
/// run of nodes in a row, or one of several bands of rows of one node.
struct DeviationPass {
  static constexpr char name[] = "DeviationPass";

  HeightWindow samples;
  Points points;
  LevelGrid grid;
  Rectangle touched;  ///< nodes that share a cell with the window
  int run = 1;        ///< nodes per run; 1 if there are several parts
  int parts = 1;      ///< bands per node
  int part_rows = 0;  ///< rows per band
  NodeArrays nodes;

  std::size_t runs_in_row() const noexcept {
    return static_cast<std::size_t>((touched.end.x - touched.first.x + run - 1) / run);
  }
  std::size_t count() const noexcept {
    return runs_in_row() * static_cast<std::size_t>(touched.end.y - touched.first.y) *
           static_cast<std::size_t>(parts);
  }

  void operator()(std::size_t index) const noexcept {
    const auto part = static_cast<int>(index % static_cast<std::size_t>(parts));
    const std::size_t which = index / static_cast<std::size_t>(parts);
    const int row = touched.first.y + static_cast<int>(which / runs_in_row());
    const int begin = touched.first.x + static_cast<int>(which % runs_in_row()) * run;
    const int end = std::min(begin + run, touched.end.x);
    int fine_begin = begin;
    int fine_end = end;
    if (!find_fine(row, fine_begin, fine_end)) fine_begin = fine_end = end;
    for (int column = begin; column < fine_begin; ++column) add_node({column, row}, part);
    if (fine_begin < fine_end) add_fine_run(row, fine_begin, fine_end);
    for (int column = fine_end; column < end; ++column) add_node({column, row}, part);
  }

 private:
  /// Returns the samples of a node that are in the window.
  Rectangle extent(glm::ivec2 node) const noexcept {
    Rectangle all = grid.samples_of(node);
    all.first.x = std::max(all.first.x, samples.first.x);
    all.first.y = std::max(all.first.y, samples.first.y);
    all.end.x = std::min(all.end.x, samples.first.x + samples.size.x);
    all.end.y = std::min(all.end.y, samples.first.y + samples.size.y);
    return all;
  }

  /// Returns whether the node has a neighbour on every side and lies entirely in the window.
  bool is_inner(glm::ivec2 node) const noexcept {
    if (!grid.has_all_neighbours(node)) return false;
    const Rectangle all = grid.samples_of(node);
    const glm::ivec2 end = samples.first + samples.size;
    return all.first.x >= samples.first.x && all.first.y >= samples.first.y && all.end.x <= end.x &&
           all.end.y <= end.y;
  }

  /// Narrows [begin, end) to inner nodes; returns false if FineRun does not cover this level, or if
  /// the nodes have holes.
  bool find_fine(int row, int& begin, int& end) const noexcept {
    if (grid.level > 1 || grid.block_cells != 2) return false;
    while (begin < end && !is_inner({begin, row})) ++begin;
    while (begin < end && !is_inner({end - 1, row})) --end;
    if (begin == end) return false;
    return !misses_any({extent({begin, row}).first, extent({end - 1, row}).end}, 1);
  }

  void add_fine_run(int row, int begin, int end) const noexcept {
    const glm::ivec2 corner = extent({begin, row}).first;
    const FineRun fine{samples.at(corner.x, corner.y), samples.row_stride, end - begin, nodes,
                       nodes.index({begin, row}, 0)};
    if (grid.level == 0) {
      fine.add_level_0();
    } else {
      fine.add_level_1();
    }
  }

  void add_node(glm::ivec2 node, int part) const noexcept {
    const Rectangle all = extent(node);
    const std::size_t out = nodes.index(node, part);
    if (grid.level == 0 && !add_heights(all, out)) return;
    if (grid.level <= last_small_level && is_inner(node) && !misses_any(all, small_step())) {
      nodes.raise(out, small_node_deviations(grid.level, samples.at(all.first.x, all.first.y),
                                             samples.row_stride, grid.block_cells));
      return;
    }
    Band band{all.first.y, all.end.y, all.end.y - 1};
    if (parts > 1) {
      band.begin += part * part_rows;
      band.end = std::min(band.begin + part_rows, all.end.y);
      band.cell_end = std::min(band.end, all.end.y - 1);
      if (band.begin >= band.end) return;
    }
    nodes.raise(out, NodeDeviation{samples, points, grid}.of(node, band));
  }

  /// Returns the spacing of the samples that must exist for small_node_deviations.
  int small_step() const noexcept { return grid.level <= 1 ? 1 : 1 << grid.level; }

  /// Returns whether any of every `step`-th sample is missing.
  bool misses_any(const Rectangle& at, int step) const noexcept {
    int missing = 0;
    for (int y = at.first.y; y < at.end.y; y += step) {
      const float* heights = samples.at(at.first.x, y);
      const int count = at.end.x - at.first.x;
      if (step == 1) {
#pragma omp simd reduction(+ : missing)
        for (int x = 0; x < count; ++x) missing += heights[x] != heights[x] ? 1 : 0;
      } else {
        for (int x = 0; x < count; x += step) missing += std::isnan(heights[x]) ? 1 : 0;
      }
    }
    return missing > 0;
  }

  /// Records the lowest and highest sample and the holes of a node of level 0. Returns false if the
  /// node is empty.
  bool add_heights(const Rectangle& at, std::size_t out) const noexcept {
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    int missing = 0;
    for (int y = at.first.y; y < at.end.y; ++y) {
      const float* heights = samples.at(at.first.x, y);
      for (int x = 0; x < at.end.x - at.first.x; ++x) {
        low = heights[x] < low ? heights[x] : low;
        high = heights[x] > high ? heights[x] : high;
        missing += std::isnan(heights[x]) ? 1 : 0;
      }
    }
    if (nodes.low_m != nullptr) {
      nodes.low_m[out] = std::min(nodes.low_m[out], low);
      nodes.high_m[out] = std::max(nodes.high_m[out], high);
    }
    if (low > high) {
      nodes.key_m[out] = joined_key(nodes.key_m[out], empty_key);
    } else if (missing > 0) {
      nodes.key_m[out] = mixed_key;
    }
    return low <= high;
  }
};

}  // namespace groundray::passes
