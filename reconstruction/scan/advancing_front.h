#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// A surface between points.
struct FrontMesh {
  TriangleMesh mesh;                   ///< each vertex one of the points, as it was, and in use
  std::vector<std::uint32_t> sources;  ///< of each vertex: which point it is, ascending
  std::size_t not_finite = 0;          ///< points that were left out for that
  std::size_t repeated = 0;            ///< and those at the place of one before
};

/// Links points that are in no order to triangles of their Delaunay tetrahedra: a front advances
/// from the smallest triangle on, always by the one that fits best. Several surfaces are found as
/// well. Points on a line, or fewer than three, give no triangle.
///
/// No edge has more than two triangles, and triangles that share one are wound alike. Equal points
/// give equal results. A hundred thousand points of a lidar take from ten seconds to some minutes:
/// each piece of surface takes a look at all tetrahedra, and points far away, where rings part,
/// make many small pieces. Organised scans are linked by other means, faster and better.
/// @param longest_perimeter_m  of a triangle: what is larger would bridge gaps.
/// @param origins_m  of each point, where its beam began: connected triangles are wound to be
///                   counter-clockwise as seen from where most of their area was seen from. Or
///                   none: then closed pieces face outwards and others upwards.
/// @throws Error if longest_perimeter_m is not positive, origins are neither none nor one for each
///         point, a finite point is farther than 1e15 m from zero along an axis, more memory is
///         needed than `work` allows, or the tetrahedra take more than 8000 bytes a point: for
///         points on two lines that pass each other they grow as the square.
/// @see Cohen-Steiner, Da, A greedy Delaunay-based surface reconstruction algorithm, The Visual
///      Computer 20 (2004).
FrontMesh advance_front(std::span<const glm::dvec3> points_m, double longest_perimeter_m,
                        std::span<const glm::dvec3> origins_m = {}, const Work& work = {});

}  // namespace groundray
