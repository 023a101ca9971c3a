#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/closest_point.h"
#include "core/mesh.h"
#include "reconstruction/manifold_mesh.h"

namespace groundray {

/// How a point lies to a surface.
enum class Cover : std::uint8_t {
  None,    ///< too far from it, or turned too far, or the surface has no normal there
  Border,  ///< beside it, by a tenth of a triangle's size or more: the nearest point is on its
           ///< border
  Inside,  ///< on it, within the limits
};

struct CoverAnswer {
  Cover cover = Cover::None;
  NearestPoint nearest;
};

/// A place that was measured, or lies on a surface that was.
struct MeasuredPlace {
  glm::dvec3 p{0};
  glm::vec3 normal{0};  ///< unit
  double sd_m = 0;
};

/// What a surface may be off and still cover a place.
struct CoverTolerance {
  double noise_sds = 0, apart_m = 0;
  double least_cosine = 0;  ///< between normals
};

/// Returns unit normals of a mesh's vertices, of some patch around each: single triangles may be
/// smaller than their noise. The sum of triangles' vectors of area depends on the patch's rim
/// alone, so what noise does to it falls as the patch grows. Zero where there is no area.
std::vector<glm::vec3> smooth_normals(const TriangleMesh& mesh);

/// A mesh that is asked which places it covers. Immutable; any number of threads may ask.
class CoverSurface {
 public:
  /// @param mesh  has triangles, and keeps check_mesh's rules.
  /// @param sd_m  of each vertex, or empty for none.
  CoverSurface(TriangleMesh mesh, std::vector<float> sd_m, const CoverTolerance& limits);

  /// @param slack_m  by which the place may be farther away than the limits say.
  /// @param near     a triangle, for speed alone.
  CoverAnswer at(const MeasuredPlace& place, double slack_m, std::uint32_t near) const noexcept;

  const TriangleMesh& mesh() const noexcept { return nearest_.mesh(); }
  const std::vector<std::uint32_t>& twins() const noexcept { return twins_; }
  /// Unit normals of the vertices, smooth.
  const std::vector<glm::vec3>& normals() const noexcept { return normals_; }
  double sd_m(std::uint32_t vertex) const noexcept { return sd_m_.empty() ? 0 : sd_m_[vertex]; }
  std::span<const float> sds_m() const noexcept { return sd_m_; }  ///< as they were given
  bool is_at_border(std::uint32_t vertex) const noexcept { return is_at_border_[vertex] != 0; }
  double area_m2(std::uint32_t triangle) const noexcept;

 private:
  bool is_on_border(std::uint32_t triangle, const glm::dvec3& shares) const noexcept;

  ClosestPoint nearest_;
  std::vector<float> sd_m_;
  CoverTolerance limits_;
  std::vector<std::uint32_t> twins_;
  std::vector<char> is_at_border_;
  std::vector<glm::vec3> normals_;
};

/// Returns what a point of a triangle takes of its corners, adding up to one; the first corner's
/// all if the triangle is a needle or a point.
glm::dvec3 shares_of_corners(const TriangleMesh& mesh, std::uint32_t triangle, const glm::dvec3& p);

}  // namespace groundray
