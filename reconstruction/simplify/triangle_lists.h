#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// Which vertices left for each triangle, in lists through their samples.
class TriangleLists {
 public:
  explicit TriangleLists(std::size_t triangles) : firsts_(triangles, none) {}

  std::uint32_t first(std::uint32_t triangle) const noexcept { return firsts_[triangle]; }
  void clear(std::uint32_t triangle) noexcept { firsts_[triangle] = none; }
  void add(std::vector<Sample>& samples, std::uint32_t triangle, std::uint32_t vertex) noexcept {
    samples[vertex].next = firsts_[triangle];
    firsts_[triangle] = vertex;
  }
  /// Puts the vertex after `prior` at the head of its list, to be looked at first.
  void bring_forward(std::vector<Sample>& samples, std::uint32_t triangle,
                     std::uint32_t prior) noexcept {
    const std::uint32_t vertex = samples[prior].next;
    samples[prior].next = samples[vertex].next;
    add(samples, triangle, vertex);
  }

 private:
  std::vector<std::uint32_t> firsts_;
};

}  // namespace groundray
