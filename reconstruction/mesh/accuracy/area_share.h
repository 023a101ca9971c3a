#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

namespace groundray {

/// Fraction of an area, 0 to 1, estimated from samples, with bounds that enclose the true fraction.
struct AreaShare {
  double value = 0;
  double at_least = 0, at_most = 1;
};

/// Resolution at which area fractions are measured.
struct ShareFineness {
  double step_m = 0;  ///< longest edge of the sampled parts; 0 for about 1e5 parts
  /// Largest number of times that a part is divided into four while its bounds leave open whether
  /// all of it is within a tolerance; at most 12.
  unsigned quarterings = 2;
};

/// Weight of a point of a surface, 0 or more; for instance 0 where it cannot be seen. Called by
/// several threads at once, with a triangle and a point on it; must always return the same value.
using SurfaceWeight = std::function<double(std::uint32_t triangle, const glm::dvec3& p)>;

}  // namespace groundray
