#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "core/model/model_io.h"

namespace groundray {

/// Polygons exactly as a file states them; nothing is checked yet.
struct PolygonSoup {
  static constexpr std::uint32_t none = 0xffffffff;

  struct Corner {
    std::uint32_t position = none, uv = none, normal = none;
  };
  /// Corners [first, first + count).
  struct Polygon {
    std::size_t first = 0, count = 0;
    std::uint32_t surface = 0;
  };
  /// Surface whose images are still names, as written in the file; empty for none.
  struct Surface {
    ModelSurface looks;
    std::string albedo, normal, opacity;
  };

  std::vector<glm::dvec3> positions;
  std::vector<glm::vec2> uv;
  std::vector<glm::vec3> normals;
  std::vector<Corner> corners;
  std::vector<Polygon> polygons;
  std::vector<Surface> surfaces;
  std::size_t skipped = 0;  ///< number of points, lines and curved patches
  std::size_t faces = 0;    ///< polygons of all meshes, without repeated instances
  double rounding = 0;  ///< bound of the error of a position's coordinates that is due to floats
};

/// Returns the linear value of an sRGB-encoded colour; components are clamped to 0 to 1.
/// @see IEC 61966-2-1.
glm::vec3 linear_color(const glm::dvec3& encoded);

/// Returns the model without its surfaces' looks: polygons are triangulated, invalid ones are
/// omitted and counted, and equal vertices are merged. `surface_of` holds indices of the soup's
/// surfaces; there may be at most 2^16.
Model model_of(const PolygonSoup& soup, ModelFaults& faults);

/// Returns the mesh alone. Its vertices are all positions of the soup in their order, used or not;
/// polygons are triangulated and counted as by model_of.
TriangleMesh stored_mesh_of(const PolygonSoup& soup, ModelFaults& faults);

}  // namespace groundray
