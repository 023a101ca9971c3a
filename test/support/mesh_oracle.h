#pragma once

#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>

#include "core/height_grid.h"

namespace groundray::testing {

/// How far a mesh lies from the reference surface, and what of the surface it covers.
struct MeshDeviation {
  double largest_m = 0;      ///< vertical, where both the mesh and the surface exist
  glm::dvec2 place{0};       ///< of that: column and row
  std::size_t triangle = 0;  ///< of that
  double largest_excess_m =  ///< the most that a deviation is over what was allowed there;
      -std::numeric_limits<double>::infinity();  ///< -inf if nothing was asked
  double rms_m = 0;              ///< at the samples that have a height and that the mesh covers
  std::size_t samples = 0;       ///< number of those
  std::size_t over_missing = 0;  ///< triangles that cover, in part, a facet that is missing
  glm::ivec2 missing_cell{-1};   ///< where the first of them does
};

/// How far a mesh may lie, metres, from a point of the surface: column, row and height in metres.
using AllowedDeviation = std::function<double(const glm::dvec3& point)>;

/// Compares triangles between samples of `grid`, of any shape and winding, with the reference
/// surface.
///
/// Both are linear on each piece that a triangle and a facet have in common, so that the largest
/// deviation lies at a corner of such a piece: at a sample, or where an edge of the triangle
/// crosses a row, a column or a diagonal between two samples. Which those are is decided in
/// integers, and each is looked at. Shares no code with the library.
///
/// Heights are compared in long double, with at most eight roundings of 2^-64 of their range each:
/// less than 1e-14 m for any heights on Earth.
/// @param vertices   column and row of each vertex, all with a height.
/// @param allowed_m  asked at each of those places if given.
MeshDeviation largest_deviation(const HeightGrid& grid, std::span<const glm::ivec2> vertices,
                                std::span<const glm::uvec3> triangles,
                                const AllowedDeviation& allowed_m = {});

}  // namespace groundray::testing
