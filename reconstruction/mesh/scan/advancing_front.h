#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Triangulated surface between points.
struct FrontMesh {
  TriangleMesh mesh;                   ///< each vertex is an input point, unchanged and in use
  std::vector<std::uint32_t> sources;  ///< of each vertex: index of its point, ascending
  std::size_t not_finite = 0;          ///< points omitted because they are not finite
  std::size_t repeated = 0;            ///< points omitted because they repeat an earlier one
};

/// Links unordered points to triangles of their Delaunay tetrahedra: a front advances from the
/// smallest triangle on, always by the most plausible one. Disconnected surfaces are found as well.
/// Points on a line, or fewer than three, give no triangle.
///
/// Each edge has at most two triangles, and triangles that share an edge are wound consistently.
/// Equal points give equal results. A hundred thousand points of a lidar take from ten seconds to
/// several minutes: each piece of surface requires a pass over all tetrahedra, and at long range,
/// where rings separate, there are many small pieces. For organised scans link() is faster and
/// better.
/// @param longest_perimeter_m  of a triangle; larger triangles would bridge gaps.
/// @param origins_m  origin of each point's beam: connected triangles are wound counter-clockwise
///                   as seen from where most of their area was seen. If empty, closed pieces face
///                   outwards and others upwards.
/// @throws Error if longest_perimeter_m is not positive, there is neither one origin per point nor
///         none, a finite point is farther than 1e15 m from zero along an axis, more memory is
///         needed than `work` allows, or the tetrahedra take more than 8000 bytes per point: for
///         points on two skew lines their number grows quadratically.
/// @see Cohen-Steiner, Da, A greedy Delaunay-based surface reconstruction algorithm, The Visual
///      Computer 20 (2004).
FrontMesh advance_front(std::span<const glm::dvec3> points_m, double longest_perimeter_m,
                        std::span<const glm::dvec3> origins_m = {}, const RunControl& work = {});

}  // namespace groundray
