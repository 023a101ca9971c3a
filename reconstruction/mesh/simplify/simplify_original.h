#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/manifold_mesh.h"
#include "reconstruction/mesh/simplify/decimation_state.h"
#include "reconstruction/mesh/simplify/simplify.h"

namespace groundray {

/// @throws Error as simplify, except for overhangs and memory.
void check_simplify(const MeasuredMesh& mesh, const StopCriterion& stop,
                    const SimplifyOptions& options);

/// Returns a triangle that has no area in plan view or faces down, or `none`. Triangles that repeat
/// a vertex are ignored.
std::uint32_t overhanging_triangle(const TriangleMesh& mesh) noexcept;

/// @throws Error naming the triangle that overhangs.
void refuse_overhang(const TriangleMesh& mesh, std::uint32_t triangle);

/// Tolerances of a simplified mesh.
struct Tolerances {
  std::vector<float> each_m;       ///< at each vertex of the manifold
  std::optional<double> border_m;  ///< at boundaries, including those between labels, if different
  bool are_noise = false;          ///< true if creases that are no deeper are ignored
};

/// Mesh prepared for simplification: a manifold, in a frame near it.
class SimplifyOriginal {
 public:
  /// @param mesh  satisfies check_simplify; must outlive this.
  /// @throws Error if every triangle repeats a vertex, or none has an area.
  explicit SimplifyOriginal(const MeasuredMesh& mesh);

  const MeasuredMesh& mesh() const noexcept { return mesh_; }
  /// Returns the manifold in its own frame, in which all computations take place.
  const ClosestPoint& surface() const noexcept { return *surface_; }
  /// Returns for each vertex of the manifold its number in the mesh.
  const std::vector<std::uint32_t>& sources() const noexcept { return manifold_.sources; }
  const MeshRepairs& repairs() const noexcept { return repairs_; }
  bool hangs_over() const noexcept { return hangs_over_; }
  double size_m() const noexcept { return size_m_; }
  /// Returns a bound of the rounding error of the distance of a point from a line, m.
  double rounding_m() const noexcept { return 1e-14 * size_m_; }
  /// Returns a mesh, given in the caller's frame, in that of the surface.
  TriangleMesh localised(TriangleMesh mesh) const;

  /// Returns equal tolerances for all vertices.
  Tolerances equal(double error_m, double border_m) const;
  /// Returns `sds` standard deviations of each vertex.
  Tolerances noise(double sds) const;
  /// Returns the initial state of a run.
  DecimationState state(const SimplifyOptions& options, const Tolerances& tolerances) const;

 private:
  const MeasuredMesh& mesh_;
  ManifoldMesh manifold_;
  MeshRepairs repairs_;
  bool hangs_over_ = false;
  double size_m_ = 0;
  glm::dvec3 origin_m_{0};
  std::optional<ClosestPoint> surface_;
};

}  // namespace groundray
