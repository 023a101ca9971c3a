#pragma once

#include <array>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace groundray {

/// Derivatives of a surface's points with respect to texture coordinates; both lie in its tangent
/// plane.
struct Tangents {
  glm::dvec3 dp_du{0};  ///< metres per unit of u
  glm::dvec3 dp_dv{0};  ///< metres per unit of v
};

/// Returns the tangents of a triangle with corners `p_m` (metres) and texture coordinates `uv`;
/// zeros if the coordinates do not span an area.
inline Tangents tangents_of_triangle(const std::array<glm::dvec3, 3>& p_m,
                                     const std::array<glm::dvec2, 3>& uv) noexcept {
  const glm::dvec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
  const double area = a.x * b.y - a.y * b.x;
  if (area == 0) return {};
  const glm::dvec3 edge_a = p_m[1] - p_m[0], edge_b = p_m[2] - p_m[0];
  return {(edge_a * b.y - edge_b * a.y) / area, (edge_b * a.x - edge_a * b.x) / area};
}

/// Returns (du, dv) of a step `d_m` (metres) in the tangent plane; zero if the tangents are
/// parallel.
inline glm::dvec2 uv_step(const Tangents& tangents, const glm::dvec3& d_m) noexcept {
  const auto& [a, b] = tangents;
  const glm::dvec3 normal = glm::cross(a, b);
  const double square = glm::dot(normal, normal);
  if (!(square > 0)) return glm::dvec2(0);
  return glm::dvec2(glm::dot(glm::cross(d_m, b), normal), glm::dot(glm::cross(a, d_m), normal)) /
         square;
}

}  // namespace groundray
