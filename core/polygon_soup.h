#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "core/model_io.h"

namespace groundray {

/// What any file of polygons says, as it says it: nothing is checked yet.
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
  /// A surface whose images are still names as the file writes them; empty for none.
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
  std::size_t skipped = 0;  ///< points, lines and curved patches
  std::size_t faces = 0;  ///< polygons of all meshes, each counted once however often it is placed
  double rounding = 0;    ///< of a position's coordinates: what floats may have lost
};

/// Returns the linear value of a colour that is encoded as sRGB, 0 to 1; others are clamped.
/// @see IEC 61966-2-1.
glm::vec3 linear_color(const glm::dvec3& encoded);

/// Returns the model without its surfaces' looks: polygons cut into triangles, faulty ones left out
/// and counted, equal vertices joined. `surface_of` is among those of the soup, which must be at
/// most 2^16.
Model model_of(const PolygonSoup& soup, ModelFaults& faults);

/// Returns the shape alone, with all of the soup's positions as its vertices, used or not, in their
/// order; polygons are cut and counted as by model_of.
TriangleMesh stored_mesh_of(const PolygonSoup& soup, ModelFaults& faults);

}  // namespace groundray
