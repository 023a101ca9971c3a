#pragma once

#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>

#include "core/geometry/height_grid.h"

namespace groundray::judge {

/// Deviation of a mesh from the reference surface, and the part of the surface that it covers.
struct MeshDeviation {
  double largest_m = 0;      ///< largest vertical distance where both mesh and surface exist
  glm::dvec2 place{0};       ///< position of largest_m: column and row
  std::size_t triangle = 0;  ///< triangle with largest_m
  double largest_excess_m =  ///< largest difference between a deviation and the allowed one there;
      -std::numeric_limits<double>::infinity();  ///< -inf if no allowed deviation was given
  double rms_m =
      0;  ///< root mean square at the samples that have a height and that the mesh covers
  std::size_t samples = 0;       ///< number of these samples
  std::size_t over_missing = 0;  ///< triangles that cover, in part, a missing facet
  glm::ivec2 missing_cell{-1};   ///< cell of the first of these triangles
};

/// Allowed deviation of a mesh at a point of the surface (column, row, height in metres), metres.
using AllowedDeviation = std::function<double(const glm::dvec3& point)>;

/// Compares triangles between samples of `grid`, of any shape and winding, with the reference
/// surface.
///
/// Both are linear on each piece that a triangle and a facet have in common. The largest deviation
/// therefore lies at a corner of such a piece: at a sample, or where an edge of the triangle
/// crosses a row, a column or a diagonal between two samples. These points are enumerated exactly,
/// in integers, and all of them are checked. Shares no code with the library.
///
/// Heights are compared in long double, with at most eight roundings of 2^-64 of their range each:
/// less than 1e-14 m for any heights on Earth.
/// @param vertices   column and row of each vertex, all with a height.
/// @param allowed_m  evaluated at each of these points, if given.
MeshDeviation largest_deviation(const HeightGrid& grid, std::span<const glm::ivec2> vertices,
                                std::span<const glm::uvec3> triangles,
                                const AllowedDeviation& allowed_m = {});

}  // namespace groundray::judge
