#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Vertices collapsed into each triangle, in lists linked through their samples.
class TriangleLists {
 public:
  explicit TriangleLists(std::size_t triangles) : firsts_(triangles, none) {}

  std::uint32_t first(std::uint32_t triangle) const noexcept { return firsts_[triangle]; }
  void clear(std::uint32_t triangle) noexcept { firsts_[triangle] = none; }
  void add(std::vector<Sample>& samples, std::uint32_t triangle, std::uint32_t vertex) noexcept {
    samples[vertex].next = firsts_[triangle];
    firsts_[triangle] = vertex;
  }
  /// Moves the vertex after `prior` to the head of its list, to be tested first.
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
