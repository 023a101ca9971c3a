#pragma once

#include <glm/vec3.hpp>

namespace glm {

dvec3 normalize(const dvec3& v);  // no pass uses it

}  // namespace glm
