#pragma once

#include <chrono>
#include <cstddef>
#include <functional>

#include "apps/python/given.h"
#include "core/point_cloud.h"
#include "core/scene.h"
#include "terrain/sensor_box.h"

namespace groundray::python {

/// Whether rays are told how far their ranges may be from those on the reference surface.
enum class ErrorBounds { Omit, Report };

/// Rays as Python gives them: points in D, and directions of any length.
class GivenRays {
 public:
  /// @throws Error if there are more of one than of the other.
  GivenRays(GivenPoints origins_m, GivenPoints directions, std::chrono::nanoseconds time);

  std::size_t size() const { return origins_m_.rows(); }
  /// Returns a ray, its direction a unit vector.
  Ray operator[](std::size_t row) const;
  /// Returns the box of where rays begin.
  SensorBox box() const;

  /// @throws Error naming the first row that is no ray.
  void check() const;

 private:
  GivenPoints origins_m_, directions_;
  std::chrono::nanoseconds time_;
};

/// Casts rays, on all cores.
/// @param rays   that have been checked.
/// @param check  called now and then; what it throws ends the work.
/// @return a row for each ray: range_true, world_x world_y world_z, nx ny nz, incidence, label and
///         instance, as a scan has them, and error_bound if asked for. Of a ray that meets nothing
///         the range is infinite, and place, normal and incidence are NaN.
PointCloud cast_rays(const Scene& scene, const GivenRays& rays, ErrorBounds bounds,
                     const std::function<void()>& check);

}  // namespace groundray::python
