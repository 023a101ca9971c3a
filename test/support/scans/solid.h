#pragma once

#include <glm/vec3.hpp>

#include "core/model/model.h"

namespace groundray::testing {

/// A box centred at the origin of O, with the given sides.
Model box_model(const glm::dvec3& sides_m);

/// An icosphere round the origin: an icosahedron, each facet split into four `splits` times, with
/// all vertices on the sphere.
Model icosphere(double radius_m, int splits);

/// A prism with many sides that stands on the xy plane; its first corner lies at (radius_m, 0).
Model cylinder(double radius_m, double height_m, int sides);

}  // namespace groundray::testing
