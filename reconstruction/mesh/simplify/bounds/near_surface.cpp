#include "reconstruction/mesh/simplify/bounds/near_surface.h"

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>
#include <utility>

namespace groundray {
namespace {

constexpr std::size_t most_uncovered_parts = 64;  // where there is no cover

}  // namespace

NearSurface::NearSurface(const ClosestPoint& to, const CoverBound& cover,
                         std::function<double(std::uint32_t)> most_m)
    : to_(to), cover_(cover), most_m_(std::move(most_m)) {}

ProofCorner NearSurface::look_at(const glm::dvec3& p_m, std::uint32_t near) {
  const NearestPoint nearest = to_.nearest(p_m, near);
  if (nearest.distance_m > farthest_.distance_m) farthest_ = nearest;
  return {.p_m = p_m,
          .nearest = nearest.triangle,
          .excess_m = nearest.distance_m - most_m_(nearest.triangle)};
}

ProofCorner NearSurface::corner(const ProofCorner& a, const ProofCorner& b, double share) {
  return look_at((1 - share) * a.p_m + share * b.p_m, a.nearest);
}

double NearSurface::excess_m(const ProofCorner& corner, std::uint32_t triangle) const {
  return to_.distance_m(corner.p_m, triangle) - most_m_(triangle);
}

bool NearSurface::holds(const std::array<glm::dvec3, 3>& corners_m, std::uint32_t near) {
  farthest_ = {.distance_m = -1};
  return holds_in_parts(corners_m, near, 3);
}

// Tests the centroid first, where most violations occur. A cover must be small and without folds,
// so triangles are subdivided.
bool NearSurface::holds_in_parts(const std::array<glm::dvec3, 3>& corners_m, std::uint32_t near,
                                 int deeper) {
  const auto& [a_m, b_m, c_m] = corners_m;
  const ProofCorner middle = look_at((a_m + b_m + c_m) / 3.0, near);
  if (!(middle.excess_m <= 0)) return false;
  const glm::dvec3 upright = glm::cross(b_m - a_m, c_m - a_m);
  if (cover_.is_within(corners_m, upright, middle.nearest, most_m_)) return true;
  if (deeper == 0) {
    const ProofCorner a = look_at(a_m, middle.nearest), b = look_at(b_m, a.nearest),
                      c = look_at(c_m, b.nearest);
    return proof_.holds({a, b, c}, most_uncovered_parts, *this);
  }
  const glm::dvec3 ab_m = 0.5 * (a_m + b_m), bc_m = 0.5 * (b_m + c_m), ca_m = 0.5 * (c_m + a_m);
  const std::array<std::array<glm::dvec3, 3>, 4> parts{
      {{ab_m, bc_m, ca_m}, {a_m, ab_m, ca_m}, {ab_m, b_m, bc_m}, {ca_m, bc_m, c_m}}};
  return std::all_of(parts.begin(), parts.end(), [&](const std::array<glm::dvec3, 3>& part) {
    return holds_in_parts(part, middle.nearest, deeper - 1);
  });
}

}  // namespace groundray
