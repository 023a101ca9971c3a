#pragma once

#include <chrono>
#include <cstddef>
#include <functional>

#include "apps/python/binding/numpy_argument.h"
#include "core/io/point_cloud.h"
#include "core/tracing/scene.h"
#include "terrain/lod/clipmap.h"

namespace groundray::python {

/// Choice of reporting bounds of range errors relative to the reference surface.
enum class ErrorBounds { Omit, Report };

/// Rays as given in Python: origins in D, m, and directions of any length.
class GivenRays {
 public:
  /// @throws Error if the numbers of origins and directions differ.
  GivenRays(GivenPoints origins_m, GivenPoints directions, std::chrono::nanoseconds time);

  std::size_t size() const { return origins_m_.rows(); }
  glm::dvec3 origin_m(std::size_t row) const { return row_of(origins_m_, row); }
  /// Returns a direction as given.
  glm::dvec3 direction(std::size_t row) const { return row_of(directions_, row); }
  /// Returns a ray with a unit direction.
  Ray operator[](std::size_t row) const;
  /// Returns the bounding box of the origins.
  SensorBox box() const;

  /// Checks that all numbers are finite and no direction is zero.
  /// @throws Error that names the first invalid row.
  void check() const;

 private:
  static glm::dvec3 row_of(const GivenPoints& rows, std::size_t row) {
    const double* const v = rows.data() + 3 * row;
    return {v[0], v[1], v[2]};
  }

  GivenPoints origins_m_, directions_;
  std::chrono::nanoseconds time_;
};

/// Casts rays on all cores. Their order affects only the speed (in fast
/// tracing also up to 5e-6 of the rays, at silhouettes): neighbours that differ are sorted
/// first.
/// @param check  called repeatedly, on any thread; an exception from it ends the work.
/// @return one row per ray: range_true, world_x world_y world_z, nx ny nz, incidence, label,
///         instance and error_estimate, as in a scan, and error_bound if requested. For a ray
///         without a hit the range is infinite; position, normal, incidence and error_estimate are
///         NaN.
/// @throws Error as GivenRays::check.
PointCloud cast_rays(const Scene& scene, const GivenRays& rays, ErrorBounds bounds,
                     const std::function<void()>& check);

}  // namespace groundray::python
