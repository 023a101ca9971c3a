#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

// An order of elimination for samples of a raster, private to this library.
namespace groundray {

/// Samples that are eliminated together, after those of two other parts that they hold apart.
struct DissectedPart {
  std::size_t begin = 0, end = 0;       ///< in the order
  std::vector<std::size_t> children{};  ///< two or none, which are told before
};

/// Samples in the order in which they are best eliminated from equations that couple neighbours.
struct Dissection {
  std::vector<std::int32_t> order;   ///< numbers of samples
  std::vector<DissectedPart> parts;  ///< the last one is the root
};

/// Returns a nested dissection: lines of samples that part the rest in two halves come last, and so
/// on within the halves.
/// @param places  columns and rows; not empty.
/// @param reach   how many columns or rows apart samples are that an equation couples, at most.
/// @see George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973).
Dissection dissect(std::span<const glm::ivec2> places, int reach);

}  // namespace groundray
