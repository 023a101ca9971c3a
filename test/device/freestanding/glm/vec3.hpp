#pragma once

#include <glm/vec2.hpp>

namespace glm {

template <typename T>
struct vec3_of {
  T x, y, z;

  vec3_of() = default;
  constexpr explicit vec3_of(T all) : x(all), y(all), z(all) {}
  constexpr vec3_of(T a, T b, T c) : x(a), y(b), z(c) {}
  constexpr explicit operator vec2_of<T>() const { return {x, y}; }
};

using dvec3 = vec3_of<double>;
using uvec3 = vec3_of<unsigned>;

}  // namespace glm
