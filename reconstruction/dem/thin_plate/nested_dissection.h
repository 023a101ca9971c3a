#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

// Elimination order for samples of a raster, private to this library.
namespace groundray {

/// Samples that are eliminated together, after the two other parts that they separate.
struct DissectedPart {
  std::size_t begin = 0, end = 0;       ///< range in the order
  std::vector<std::size_t> children{};  ///< two or none, which precede this part
};

/// Fill-reducing order of samples for eliminating equations that couple neighbours.
struct Dissection {
  std::vector<std::int32_t> order;   ///< numbers of samples
  std::vector<DissectedPart> parts;  ///< the last one is the root
};

/// Returns a nested dissection: separators that divide the other samples into two halves come last,
/// and so on within the halves.
/// @param places  columns and rows; not empty.
/// @param reach  largest distance of samples coupled by an equation, in columns or rows.
/// @see George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973).
Dissection dissect(std::span<const glm::ivec2> places, int reach);

}  // namespace groundray
