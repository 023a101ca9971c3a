#pragma once

#include <glm/vec3.hpp>

#include "core/model.h"

namespace groundray::testing {

/// A box round the origin of O, with the given sides.
Model box_model(const glm::dvec3& sides_m);

/// A ball of facets whose vertices lie on a sphere round the origin: an icosahedron, each facet
/// parted in four `splits` times.
Model icosphere(double radius_m, int splits);

/// A prism of many sides upon the xy plane; its first corner lies at (radius_m, 0).
Model cylinder(double radius_m, double height_m, int sides);

}  // namespace groundray::testing
