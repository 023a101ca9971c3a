#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>

namespace groundray {

/// Tracing mode. Ranges are the same in both: within 1e-9 * range + 1e-9 m of the surface that the
/// levels define.
enum class Tracing {
  Fast,   ///< Embree selects the facet; it may differ for at most 5e-6 of the rays, those that
          ///< graze a silhouette
  Exact,  ///< every facet is tested in double
};

/// A ray in D: a point (m) and a unit vector.
struct Ray {
  glm::dvec3 origin{0};
  glm::dvec3 direction{0, 0, -1};
  double far_m = std::numeric_limits<double>::infinity();  ///< hits beyond it are ignored
  std::chrono::nanoseconds time{0};                        ///< time at which moving objects are hit
};

/// Similarity of neighbouring rays in a batch; neighbours are traced in packets.
enum class Batch {
  Alike,       ///< neighbours begin near each other and are nearly parallel
  ShadowRays,  ///< they are nearly parallel and begin at hits of earlier rays
  Scattered,   ///< they begin at hits of earlier rays and have any direction
};

/// Returns the first-order effect of a surface's vertical deviation on a range, m: exact if the
/// ground is planar there.
/// @param normal_z       of the surface's unit normal.
/// @param cos_incidence  of the angle between ray and normal.
inline float error_estimate_m(float deviation_m, float normal_z, float cos_incidence) {
  return deviation_m == 0 ? 0 : deviation_m * normal_z / std::max(cos_incidence, 1e-6f);
}

/// First hit of a ray.
struct Hit {
  double range_m =
      std::numeric_limits<double>::infinity();  ///< along the ray; infinite without a hit
  glm::vec3 normal{0};       ///< of the facet, unit, in D: up (ground) or towards the ray (object)
  float deviation_m = 0;     ///< of the leaf: largest vertical distance from the reference surface
  std::uint32_t part = 0;    ///< index of the level that was hit; on an object, of the triangle
  std::uint32_t object = 0;  ///< number of the object that was hit; 0 for the ground
  explicit operator bool() const noexcept {
    return range_m < std::numeric_limits<double>::infinity();
  }
};

}  // namespace groundray
