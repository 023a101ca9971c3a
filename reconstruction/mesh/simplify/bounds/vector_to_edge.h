#pragma once

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace groundray {

/// Returns the vector from `p` to the nearest point of the edge from `a` to `b`.
inline glm::dvec3 vector_to_edge(const glm::dvec3& p, const glm::dvec3& a,
                                 const glm::dvec3& b) noexcept {
  const glm::dvec3 edge = b - a, from = a - p;
  const double square = glm::dot(edge, edge);
  if (!(square > 0)) return from;
  return from + std::clamp(-glm::dot(from, edge) / square, 0.0, 1.0) * edge;
}

}  // namespace groundray
