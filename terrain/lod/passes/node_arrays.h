#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>

namespace groundray::passes {

/// Window of nodes, divided into runs within rows; each run is one index of a pass.
struct NodeRuns {
  glm::ivec2 size{0};
  int length = 1;  ///< nodes in a run, at most

  struct Run {
    int row, begin, end;  ///< relative to the window's first node
  };
  std::size_t in_row() const noexcept {
    return static_cast<std::size_t>((size.x + length - 1) / length);
  }
  std::size_t count() const noexcept { return in_row() * static_cast<std::size_t>(size.y); }
  Run at(std::size_t index) const noexcept {
    const int begin = static_cast<int>(index % in_row()) * length;
    return {static_cast<int>(index / in_row()), begin, std::min(begin + length, size.x)};
  }
};

/// Returns whether any of `count` states has any of `bits`.
inline bool any_has(const std::uint8_t* states, int count, std::uint8_t bits) noexcept {
  std::uint8_t all = 0;
  for (int i = 0; i < count; ++i) all |= states[i];
  return (all & bits) != 0;
}

/// States of the nodes of a window.
struct StateWindow {
  glm::ivec2 first{0};
  glm::ivec2 size{0};
  std::uint8_t* state = nullptr;

  std::uint8_t* row(int row) const noexcept {
    return state + static_cast<std::ptrdiff_t>(row) * size.x;
  }
  /// Returns the state of a node; 0 outside the window.
  std::uint8_t at(int column, int row) const noexcept {
    const int x = column - first.x;
    const int y = row - first.y;
    return x < 0 || y < 0 || x >= size.x || y >= size.y ? 0 : this->row(y)[x];
  }
  /// Returns whether any node in columns [begin, end) and rows first_row to last_row has any of
  /// `bits`.
  bool any_has(int begin, int end, int first_row, int last_row, std::uint8_t bits) const noexcept {
    const int x = std::max(begin - first.x, 0);
    const int count = std::min(end - first.x, size.x) - x;
    for (int y = std::max(first_row - first.y, 0); y <= std::min(last_row - first.y, size.y - 1);
         ++y) {
      if (passes::any_has(row(y) + x, count, bits)) return true;
    }
    return false;
  }
};

/// Keys of nodes before saturation that are not deviations. Unknown: no window has been added yet.
inline constexpr float unknown_key = -std::numeric_limits<float>::infinity();
inline constexpr float empty_key = -1;  ///< no sample has a height
inline constexpr float mixed_key = std::numeric_limits<float>::infinity();

/// Returns the key of two parts of a node together: mixed if one is empty and the other is not.
inline float joined_key(float a, float b) noexcept {
  if (a == unknown_key) return b;
  if (b == unknown_key) return a;
  if ((a == empty_key) != (b == empty_key)) return mixed_key;
  return std::max(a, b);
}

/// Returns the smallest float that is not below `value`, which must not be negative.
inline float rounded_up(double value) noexcept {
  const auto nearest = static_cast<float>(value);
  // The next larger float has the next integer as its bit pattern.
  const std::uint32_t step = nearest < value ? 1 : 0;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) + step);
}

/// Largest vertical distances between a node and the reference surface, metres.
struct Deviations {
  double full = 0;     ///< of the node's own cells, with no side thinned
  double thinned = 0;  ///< of the cells whose halves differ where a side is thinned
};

/// Output arrays of a pass over the nodes of a level: `parts` values for each node of a rectangle.
/// Pointers may be null.
struct NodeArrays {
  glm::ivec2 first{0};
  glm::ivec2 size{0};
  int parts = 1;
  float* key_m = nullptr;
  float* deviation_m = nullptr;
  float* full_m = nullptr;
  float* low_m = nullptr;
  float* high_m = nullptr;

  std::size_t index(glm::ivec2 node, int part) const noexcept {
    const glm::ivec2 local = node - first;
    return (static_cast<std::size_t>(local.y) * static_cast<std::size_t>(size.x) +
            static_cast<std::size_t>(local.x)) *
               static_cast<std::size_t>(parts) +
           static_cast<std::size_t>(part);
  }
  void raise(std::size_t at, const Deviations& found) const noexcept {
    const float deviation = rounded_up(std::max(found.full, found.thinned));
    if (key_m != nullptr) key_m[at] = joined_key(key_m[at], deviation);
    if (deviation_m == nullptr) return;
    deviation_m[at] = std::max(deviation_m[at], deviation);
    full_m[at] = std::max(full_m[at], rounded_up(found.full));
  }
};

/// Joins the parts of each node.
struct JoinPartsPass {
  static constexpr char name[] = "JoinPartsPass";

  NodeArrays parts;
  NodeArrays nodes;

  void operator()(std::size_t index) const noexcept {
    const glm::ivec2 node =
        parts.first + glm::ivec2(index % static_cast<std::size_t>(parts.size.x),
                                 index / static_cast<std::size_t>(parts.size.x));
    const std::size_t out = nodes.index(node, 0);
    for (int part = 0; part < parts.parts; ++part) {
      const std::size_t in = parts.index(node, part);
      const float deviation = parts.deviation_m[in];
      nodes.key_m[out] = joined_key(nodes.key_m[out], deviation);
      if (nodes.deviation_m == nullptr) continue;
      nodes.deviation_m[out] = std::max(nodes.deviation_m[out], deviation);
      nodes.full_m[out] = std::max(nodes.full_m[out], parts.full_m[in]);
    }
  }
};

/// Raises keys to those of the children, and extends the height ranges to theirs. An index is a run
/// of nodes.
struct SaturatePass {
  static constexpr char name[] = "SaturatePass";

  NodeRuns runs;
  NodeArrays nodes;
  NodeArrays children;  ///< all children of the nodes

  void operator()(std::size_t index) const noexcept {
    const NodeRuns::Run run = runs.at(index);
    const glm::ivec2 last = children.first + children.size - 1;
    const int row = 2 * (nodes.first.y + run.row);
    const std::size_t out = nodes.index(nodes.first + glm::ivec2{0, run.row}, 0);
    // A child beyond the end of the lattice is represented by the one before it.
    const std::size_t upper = children.index({children.first.x, row}, 0);
    const std::size_t lower = children.index({children.first.x, std::min(row + 1, last.y)}, 0);
    for (int x = run.begin; x < run.end; ++x) {
      const int column = 2 * (nodes.first.x + x);
      const auto left = static_cast<std::size_t>(column - children.first.x);
      const auto right = static_cast<std::size_t>(std::min(column + 1, last.x) - children.first.x);
      const std::size_t family[4] = {upper + left, upper + right, lower + left, lower + right};
      raise(out + static_cast<std::size_t>(x), family);
    }
  }

 private:
  void raise(std::size_t node, const std::size_t (&family)[4]) const noexcept {
    float low = children.key_m[family[0]];
    float high = low;
    for (const std::size_t child : family) {
      low = std::min(low, children.key_m[child]);
      high = std::max(high, children.key_m[child]);
    }
    const float key = std::max(nodes.key_m[node], low < 0 ? mixed_key : high);
    nodes.key_m[node] = high < 0 ? empty_key : key;
    if (nodes.low_m == nullptr) return;
    for (const std::size_t child : family) {
      nodes.low_m[node] = std::min(nodes.low_m[node], children.low_m[child]);
      nodes.high_m[node] = std::max(nodes.high_m[node], children.high_m[child]);
    }
  }
};

}  // namespace groundray::passes
