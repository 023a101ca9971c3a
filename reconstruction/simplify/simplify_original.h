#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/closest_point.h"
#include "reconstruction/manifold_mesh.h"
#include "reconstruction/simplify/simplify.h"
#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// How near a simplified mesh must be.
struct Tolerances {
  std::vector<float> each_m;       ///< to each vertex of the manifold
  std::optional<double> border_m;  ///< to borders and those of labels, if not the same
  bool are_noise = false;          ///< creases that are no deeper are none
};

/// A mesh that is to be simplified, made ready: a manifold, in a frame near it.
class SimplifyOriginal {
 public:
  /// @param mesh  as check_simplify asks; must outlive this.
  /// @throws Error if there is no triangle but what names a vertex twice, or none has an area.
  explicit SimplifyOriginal(const MeasuredMesh& mesh);

  const MeasuredMesh& mesh() const noexcept { return mesh_; }
  /// Returns the manifold in its own frame, in which all is computed.
  const ClosestPoint& surface() const noexcept { return *surface_; }
  /// Returns, of each of the manifold's vertices, which of the mesh it was.
  const std::vector<std::uint32_t>& sources() const noexcept { return manifold_.sources; }
  const MeshRepairs& repairs() const noexcept { return repairs_; }
  bool hangs_over() const noexcept { return hangs_over_; }
  double size_m() const noexcept { return size_m_; }
  /// Returns what rounding takes off a line that is on it, at most.
  double rounding_m() const noexcept { return 1e-14 * size_m_; }
  /// Returns a mesh of the caller's frame in that of the surface.
  TriangleMesh localised(TriangleMesh mesh) const;

  /// Returns the same tolerance for all.
  Tolerances equal(double error_m, double border_m) const;
  /// Returns so many standard deviations of each.
  Tolerances noise(double sds) const;
  /// Returns what a run begins with.
  Workpiece workpiece(const SimplifyOptions& options, const Tolerances& tolerances) const;

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
