#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"

namespace groundray {

/// Relation of a point to a surface.
enum class Cover : std::uint8_t {
  None,    ///< too far away, turned too far, or without a surface normal there
  Border,  ///< beyond the boundary by at least a tenth of a triangle's size; the nearest point is
           ///< on the boundary
  Inside,  ///< on the surface, within the tolerance
};

struct CoverAnswer {
  Cover cover = Cover::None;
  NearestPoint nearest;
};

/// Position that was measured, or that lies on a measured surface.
struct MeasuredPlace {
  glm::dvec3 p{0};
  glm::vec3 normal{0};  ///< unit
  double sd_m = 0;
};

/// Tolerance within which a surface covers a position; see MergeLimits.
struct CoverTolerance {
  double noise_sds = 0, apart_m = 0;
  double least_cosine = 0;  ///< of the angle between normals
};

/// Returns unit normals of a mesh's vertices, each from a patch of triangles around the vertex,
/// because single triangles may be smaller than their noise. The sum of area vectors depends only
/// on the patch's boundary, so the effect of noise falls as the patch grows. Zero where there is no
/// area.
std::vector<glm::vec3> smooth_normals(const TriangleMesh& mesh);

/// Mesh that can be queried for the positions that it covers. Immutable; safe for concurrent use.
class CoverSurface {
 public:
  /// @param mesh  at least one triangle; satisfies check_mesh.
  /// @param sd_m  of each vertex, or empty for none.
  CoverSurface(TriangleMesh mesh, std::vector<float> sd_m, const CoverTolerance& limits);

  /// Returns the relation of a position to the surface.
  /// @param slack_m  additional permitted distance.
  /// @param near     a triangle near the position; affects speed only.
  CoverAnswer at(const MeasuredPlace& place, double slack_m, std::uint32_t near) const noexcept;

  const TriangleMesh& mesh() const noexcept { return nearest_.mesh(); }
  /// Returns the smoothed unit normals of the vertices.
  const std::vector<glm::vec3>& normals() const noexcept { return normals_; }
  double sd_m(std::uint32_t vertex) const noexcept { return sd_m_.empty() ? 0 : sd_m_[vertex]; }
  std::span<const float> sds_m() const noexcept { return sd_m_; }  ///< as given
  /// Returns true if nothing lies beyond the edge of a triangle from its corner `k` to the next.
  bool is_border(std::uint32_t triangle, int k) const noexcept {
    return (borders_[triangle] >> k & 1) != 0;
  }
  bool is_at_border(std::uint32_t vertex) const noexcept { return is_at_border_[vertex] != 0; }
  double area_m2(std::uint32_t triangle) const noexcept;

 private:
  bool is_on_border(std::uint32_t triangle, const glm::dvec3& shares) const noexcept;

  ClosestPoint nearest_;
  std::vector<float> sd_m_;
  CoverTolerance limits_;
  std::vector<std::uint8_t> borders_;  // of each triangle: bit k is set if is_border(triangle, k)
  std::vector<char> is_at_border_;
  std::vector<glm::vec3> normals_;
};

/// Returns the barycentric coordinates of a point in a triangle's plane, which add up to one; those
/// of the first corner if the triangle has no area.
glm::dvec3 shares_of_corners(const TriangleMesh& mesh, std::uint32_t triangle, const glm::dvec3& p);

/// Calls `visit(begin, end)` for each block of `in_block` numbers below `count`, several at once.
void for_blocks(std::size_t count, std::size_t in_block,
                const std::function<void(std::size_t begin, std::size_t end)>& visit);

}  // namespace groundray
