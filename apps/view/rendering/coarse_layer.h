#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "apps/view/rendering/layer.h"

namespace groundray {

/// Some triangles of a surface, with their own numbers for the vertices that they use.
class KeptTriangles {
 public:
  /// @param count  number of vertices of the surface.
  explicit KeptTriangles(std::size_t count);

  /// @param corner  vertices of the surface.
  /// @param cell    index of the triangle in the surface.
  void add(glm::uvec3 corner, std::size_t cell);

  std::vector<std::uint32_t> vertices, cells;  ///< kept ones, as indices into the surface
  std::vector<glm::uvec3> triangles;           ///< indices into `vertices`

 private:
  std::vector<std::uint32_t> number_;
};

/// Minimum number of points or triangles to which a layer is thinned, so that small objects remain
/// visible.
inline constexpr std::size_t fewest_elements = 500;

/// Returns about `points` of a cloud's points (at least `fewest_elements`) with all their values.
/// The choice is pseudo-random but deterministic and nested: a larger number keeps the same points
/// and adds others. Returns the cloud's own data if it has no more points.
vtkSmartPointer<vtkPolyData> thin_points(const Layer& cloud, std::size_t points);

/// Returns a surface with at most `triangles` triangles (at least `fewest_elements`), or the
/// surface itself if it has no more. Vertex clustering: all vertices in one cell of a grid become
/// one of them; degenerate and duplicate triangles are omitted. If that leaves less than 1/8 of
/// `triangles`, as for many objects smaller than a cell, the largest triangles are kept instead.
/// The kept points and triangles keep their values.
/// @see Rossignac, Borrel, Multi-resolution 3D approximations for rendering complex scenes (1993).
vtkSmartPointer<vtkPolyData> thin_triangles(const Layer& surface, std::size_t triangles);

}  // namespace groundray
