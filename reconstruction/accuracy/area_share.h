#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

namespace groundray {

/// A share of an area, 0 to 1, as samples tell, and bounds between which the true one lies.
struct AreaShare {
  double value = 0;
  double at_least = 0, at_most = 1;
};

/// How finely shares are measured.
struct ShareFineness {
  double step_m =
      0;  ///< edges of parts that have a sample are at most so long; 0 for some 1e5 parts
  /// How often parts are cut into four where it is open whether all of them is within a tolerance;
  /// at most 12 times.
  unsigned quarterings = 2;
};

/// What a place of a surface counts, 0 for nothing and never less: whether it can be seen, say.
/// Called by several threads at once, with a triangle and a point on it; must return the same at
/// any time.
using SurfaceWeight = std::function<double(std::uint32_t triangle, const glm::dvec3& p)>;

}  // namespace groundray
