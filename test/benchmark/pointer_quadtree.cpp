#include "test/benchmark/pointer_quadtree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "terrain/lod/lattice.h"

namespace groundray::benchmark {
namespace {

enum Side { North, East, South, West };
constexpr std::array sides{North, East, South, West};

struct Node {
  int level = 0;
  glm::ivec2 place{0};
  Node* parent = nullptr;
  std::array<std::unique_ptr<Node>, 4> children;
  bool is_leaf = true;
};

std::size_t child_at(glm::ivec2 place) {
  const int index = (place.x & 1) + 2 * (place.y & 1);
  return static_cast<std::size_t>(index);
}

// Neighbour of equal or larger size across a side; null at the DEM's boundary.
Node* neighbour(const Node& node, Side side) {
  if (node.parent == nullptr) return nullptr;
  const bool vertical = side == North || side == South;
  const bool towards_end = side == East || side == South;
  const glm::ivec2 mirrored = node.place ^ (vertical ? glm::ivec2(0, 1) : glm::ivec2(1, 0));
  const bool in_parent = ((vertical ? node.place.y : node.place.x) & 1) != (towards_end ? 1 : 0);
  Node* around = in_parent ? node.parent : neighbour(*node.parent, side);
  if (around == nullptr || around->is_leaf) return around;
  return around->children[child_at(mirrored)].get();
}

class Mesher {
 public:
  Mesher(const HeightGrid& grid, std::span<const NodeLevel> levels, int block_cells,
         double tolerance_m)
      : grid_(grid),
        levels_(levels),
        lattice_{{grid.columns(), grid.rows()}, block_cells},
        tolerance_m_(tolerance_m),
        flipped_(grid.step_m().x * grid.step_m().y < 0) {}

  TerrainMesh mesh() {
    Node root;
    root.level = lattice_.top_level();
    refine(root);
    emit(root);
    return std::move(mesh_);
  }

 private:
  void refine(Node& node) {
    const NodeLevel& level = levels_[static_cast<std::size_t>(node.level)];
    const auto index =
        static_cast<std::size_t>(node.place.y) * static_cast<std::size_t>(level.size.x) +
        static_cast<std::size_t>(node.place.x);
    if (!(static_cast<double>(level.key_m[index]) > tolerance_m_)) return;
    if (node.level == 0) {
      // The node exceeds the bound if thinned, so no neighbour may be coarser.
      split_coarser_neighbours(node);
    } else {
      split(node);
      for (const auto& child : node.children) {
        if (child) refine(*child);
      }
    }
  }

  void split(Node& node) {
    if (!node.is_leaf) return;
    split_coarser_neighbours(node);
    node.is_leaf = false;
    const glm::ivec2 end = lattice_.nodes(node.level - 1);
    for (const glm::ivec2 offset :
         {glm::ivec2(0, 0), glm::ivec2(1, 0), glm::ivec2(0, 1), glm::ivec2(1, 1)}) {
      const glm::ivec2 place = node.place * 2 + offset;
      if (place.x >= end.x || place.y >= end.y) continue;
      auto child = std::make_unique<Node>();
      child->level = node.level - 1;
      child->place = place;
      child->parent = &node;
      node.children[child_at(place)] = std::move(child);
    }
  }

  void split_coarser_neighbours(const Node& node) {
    for (const Side side : sides) {
      for (Node* beside = neighbour(node, side); beside != nullptr && beside->level > node.level;
           beside = neighbour(node, side)) {
        split(*beside);
      }
    }
  }

  void emit(const Node& node) {
    if (node.is_leaf) return emit_leaf(node);
    for (const auto& child : node.children) {
      if (child) emit(*child);
    }
  }

  // The leaf that is being emitted.
  struct Block {
    int level = 0;
    glm::ivec2 first{0};  // cell of the level
    glm::ivec2 cells{0};
    std::array<bool, 4> thinned{};
    int last = 0;  // cells along a side of a whole block

    // True for a point of the block that the coarser neighbour lacks. An odd last point lies on the
    // DEM's boundary and stays.
    bool dropped(glm::ivec2 p) const {
      const bool odd_column = p.x % 2 == 1 && p.x < cells.x;
      const bool odd_row = p.y % 2 == 1 && p.y < cells.y;
      return (thinned[North] && p.y == 0 && odd_column) ||
             (thinned[South] && p.y == last + 1 && odd_column) ||
             (thinned[West] && p.x == 0 && odd_row) ||
             (thinned[East] && p.x == last + 1 && odd_row);
    }
    bool on_main_diagonal(glm::ivec2 c) const {
      return (thinned[North] && c.y == 0 && c.x % 2 == 0 && c.x + 1 < cells.x) ||
             (thinned[West] && c.x == 0 && c.y % 2 == 0 && c.y + 1 < cells.y) ||
             (thinned[South] && c.y == last && c.x % 2 == 1) ||
             (thinned[East] && c.x == last && c.y % 2 == 1);
    }
  };

  void emit_leaf(const Node& leaf) {
    const int size = lattice_.block_cells;
    Block block{leaf.level, leaf.place * size, {}, {}, size - 1};
    const glm::ivec2 left = lattice_.cells(leaf.level) - block.first;
    block.cells = {std::min(size, left.x), std::min(size, left.y)};
    for (const Side side : sides) {
      const Node* const beside = neighbour(leaf, side);
      block.thinned[side] = beside != nullptr && beside->level > leaf.level;
    }
    for (glm::ivec2 c(0); c.y < block.cells.y; ++c.y) {
      for (c.x = 0; c.x < block.cells.x; ++c.x) emit_cell(block, c);
    }
    emit_borders(block);
  }

  // Emits both halves of a cell, except those at a dropped point.
  void emit_cell(const Block& block, glm::ivec2 c) {
    const glm::ivec2 east = c + glm::ivec2(1, 0);
    const glm::ivec2 south = c + glm::ivec2(0, 1);
    const glm::ivec2 far = c + 1;
    if (block.on_main_diagonal(c)) {
      emit(block, {c, east, far});
      emit(block, {c, far, south});
    } else {
      emit(block, {c, east, south});
      emit(block, {far, south, east});
    }
  }

  // At each dropped point, emits one triangle from the boundary's even points to the interior
  // point.
  void emit_borders(const Block& block) {
    for (int i = 1; i < block.cells.x; i += 2) {
      if (block.thinned[North]) emit(block, {{{i - 1, 0}, {i + 1, 0}, {i, 1}}});
      const int end = block.last + 1;
      if (block.thinned[South]) emit(block, {{{i + 1, end}, {i - 1, end}, {i, end - 1}}});
    }
    for (int i = 1; i < block.cells.y; i += 2) {
      if (block.thinned[West]) emit(block, {{{0, i + 1}, {0, i - 1}, {1, i}}});
      const int end = block.last + 1;
      if (block.thinned[East]) emit(block, {{{end, i - 1}, {end, i + 1}, {end - 1, i}}});
    }
  }

  void emit(const Block& block, const std::array<glm::ivec2, 3>& corners) {
    std::array<glm::ivec2, 3> samples;
    for (std::size_t i = 0; i < 3; ++i) {
      if (block.dropped(corners[i])) return;
      samples[i] = lattice_.sample(block.level, block.first + corners[i]);
      if (std::isnan(grid_.height_m(samples[i].x, samples[i].y))) return;
    }
    glm::uvec3 triangle(number_of(samples[0]), number_of(samples[1]), number_of(samples[2]));
    if (flipped_) std::swap(triangle.y, triangle.z);
    mesh_.triangles.push_back(triangle);
    mesh_.levels.push_back(static_cast<std::uint8_t>(block.level));
  }

  std::uint32_t number_of(glm::ivec2 sample) {
    const std::int64_t key = (std::int64_t{sample.y} << 32) + sample.x;
    const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto [place, is_new] = numbers_.try_emplace(key, next);
    if (is_new) mesh_.vertices.push_back(sample);
    return place->second;
  }

  const HeightGrid& grid_;
  std::span<const NodeLevel> levels_;
  Lattice lattice_;
  double tolerance_m_;
  bool flipped_;
  std::unordered_map<std::int64_t, std::uint32_t> numbers_;
  TerrainMesh mesh_;
};

}  // namespace

TerrainMesh mesh_by_pointers(const HeightGrid& grid, std::span<const NodeLevel> levels,
                             int block_cells, double tolerance_m) {
  return Mesher(grid, levels, block_cells, tolerance_m).mesh();
}

}  // namespace groundray::benchmark
