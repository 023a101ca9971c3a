#pragma once

#include <glm/vec2.hpp>
#include <vector>

namespace groundray {

/// Returns the area of the convex hull of points; 0 for fewer than three.
double hull_area(std::vector<glm::dvec2> points);

}  // namespace groundray
