#include "test/support/terrain/slow_quadtree.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace groundray::testing {
namespace {

Real gap(Real low, Real high, Real other_low, Real other_high) {
  return std::max({Real(0), other_low - high, low - other_high});
}

}  // namespace

void Known::show(int level, glm::ivec2 first, glm::ivec2 end) {
  const NodeLevel& all = levels[std::size_t(level)];
  NodeLevel& part = shown[std::size_t(level)];
  part = {end - first, {}, {}, {}, {}, {}};
  for (int r = first.y; r < end.y; ++r) {
    for (int c = first.x; c < end.x; ++c) {
      const auto at = std::size_t(r) * std::size_t(all.size.x) + std::size_t(c);
      part.key_m.push_back(all.key_m[at]);
      part.deviation_m.push_back(all.deviation_m[at]);
      part.full_m.push_back(all.full_m[at]);
      part.low_m.push_back(all.low_m[at]);
      part.high_m.push_back(all.high_m[at]);
    }
  }
  windows[std::size_t(level)] = whole_window(part);
  windows[std::size_t(level)].first = first;
}

void Known::show_windows_round(glm::dvec2 place, int side) {
  for (int level = 0; level < lattice.top_level(); ++level) {
    const glm::ivec2 all = lattice.nodes(level);
    if (all.x <= side && all.y <= side) break;
    glm::ivec2 first;
    glm::ivec2 end;
    for (int axis = 0; axis < 2; ++axis) {
      const int width = lattice.block_cells << level;
      const int middle = int(place[axis]) / (2 * width) * 2;
      first[axis] = std::clamp(middle - side / 2, 0, std::max(0, (all[axis] - side + 1) / 2 * 2));
      end[axis] = std::min(first[axis] + side, all[axis]);
    }
    show(level, first, end);
  }
}

Real bound_of(const Known& known, const MeshBound& bound, const Node& node) {
  if (bound.angle_rad == 0) return bound.tolerance_m;
  const glm::ivec2 block = glm::ivec2(node.column, node.row) * known.lattice.block_cells;
  const glm::ivec2 first = known.lattice.sample(node.level, block);
  const glm::ivec2 last = known.lattice.sample(node.level, block + known.lattice.block_cells);
  const std::size_t at = known.index(node);
  // The sensors' bounding box, widened to whole squares of nodes of this level.
  std::array<Real, 3> low{};
  std::array<Real, 3> high{};
  for (int axis = 0; axis < 3; ++axis) {
    const Real cell_m = axis < 2 ? bound.cell_m[axis] : std::min(bound.cell_m.x, bound.cell_m.y);
    const Real unit_m =
        cell_m * ((bound.widened_to_nodes * known.lattice.block_cells) << node.level);
    const bool is_widened = unit_m > 0;
    const auto i = static_cast<std::size_t>(axis);
    low[i] = is_widened ? std::floor(bound.low_m[axis] / unit_m) * unit_m : bound.low_m[axis];
    high[i] = is_widened ? std::ceil(bound.high_m[axis] / unit_m) * unit_m : bound.high_m[axis];
  }
  const Real x =
      gap(first.x * Real(bound.cell_m.x), last.x * Real(bound.cell_m.x), low[0], high[0]);
  const Real y =
      gap(first.y * Real(bound.cell_m.y), last.y * Real(bound.cell_m.y), low[1], high[1]);
  const Real z = gap(known.of(node).low_m[at], known.of(node).high_m[at], low[2], high[2]);
  return std::max(Real(bound.tolerance_m), bound.angle_rad * std::sqrt(x * x + y * y + z * z));
}

SlowQuadtree::SlowQuadtree(const Known& known, const MeshBound& bound)
    : known_(known), bound_(bound) {
  add({known.lattice.top_level(), 0, 0});
  for (bool changed = true; changed;) {
    changed = false;
    for (const Node& leaf : std::vector<Node>(leaves_.begin(), leaves_.end())) {
      if (can_split(leaf) && must_split(leaf)) {
        changed = true;
        split(leaf);
      }
    }
  }
}

SlowQuadtree::Rectangle SlowQuadtree::cells(const Node& node) const {
  const int side = known_.lattice.block_cells << node.level;
  const glm::ivec2 first = glm::ivec2(node.column, node.row) * side;
  const glm::ivec2 last = known_.lattice.samples - 1;
  return {first, {std::min(first.x + side, last.x), std::min(first.y + side, last.y)}};
}

void SlowQuadtree::add(const Node& node) {
  leaves_.insert(node);
  const Rectangle at = cells(node);
  for (int r = at.first.y; r < at.end.y; ++r) {
    for (int c = at.first.x; c < at.end.x; ++c) level_[{c, r}] = node.level;
  }
}

void SlowQuadtree::split(const Node& node) {
  leaves_.erase(node);
  const glm::ivec2 all = known_.lattice.nodes(node.level - 1);
  for (int r = 2 * node.row; r < std::min(2 * node.row + 2, all.y); ++r) {
    for (int c = 2 * node.column; c < std::min(2 * node.column + 2, all.x); ++c) {
      add({node.level - 1, c, r});
    }
  }
}

bool SlowQuadtree::can_split(const Node& node) const {
  if (node.level == 0) return false;
  const NodeWindow& below = known_.windows[std::size_t(node.level - 1)];
  const glm::ivec2 child = 2 * glm::ivec2(node.column, node.row) - below.first;
  return child.x >= 0 && child.y >= 0 && child.x < below.size.x && child.y < below.size.y;
}

bool SlowQuadtree::exceeds(const Node& node) const {
  const float key = known_.of(node).key_m[known_.index(node)];
  return key == std::numeric_limits<float>::infinity() || key > bound_of(known_, bound_, node);
}

bool SlowQuadtree::must_split(const Node& node) const {
  return exceeds(node) || straddles_a_window(node) || has_too_fine_a_neighbour(node);
}

bool SlowQuadtree::straddles_a_window(const Node& node) const {
  const Rectangle at = cells(node);
  for (int level = 0; level < node.level; ++level) {
    const NodeWindow& window = known_.windows[std::size_t(level)];
    if (window.size.x == 0) continue;
    int inside = 0;
    for (int r = at.first.y; r < at.end.y; ++r) {
      for (int c = at.first.x; c < at.end.x; ++c) {
        const glm::ivec2 fine = (glm::ivec2(c, r) >> level) / known_.lattice.block_cells;
        const glm::ivec2 local = fine - window.first;
        const bool is_in =
            local.x >= 0 && local.y >= 0 && local.x < window.size.x && local.y < window.size.y;
        inside += is_in ? 1 : 0;
      }
    }
    const int all = (at.end.x - at.first.x) * (at.end.y - at.first.y);
    if (inside != 0 && inside != all) return true;
  }
  return false;
}

bool SlowQuadtree::has_too_fine_a_neighbour(const Node& node) const {
  const Rectangle at = cells(node);
  bool found = false;
  const auto look = [&](int c, int r) {
    const auto level = level_.find({c, r});
    if (level == level_.end()) return;
    const int side = known_.lattice.block_cells << level->second;
    const Node neighbour{level->second, c / side, r / side};
    found |= neighbour.level < node.level - 1 ||
             (neighbour.level == node.level - 1 && exceeds(neighbour) && !can_split(neighbour));
  };
  for (int r = at.first.y; r < at.end.y; ++r) {
    look(at.first.x - 1, r);
    look(at.end.x, r);
  }
  for (int c = at.first.x; c < at.end.x; ++c) {
    look(c, at.first.y - 1);
    look(c, at.end.y);
  }
  return found;
}

}  // namespace groundray::testing
