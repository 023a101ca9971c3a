#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "apps/view/compare/deviation.h"
#include "reconstruction/mesh/accuracy/angle_spread.h"

namespace groundray {
namespace {

constexpr double no_sign = std::numeric_limits<double>::quiet_NaN();

// Returns for each vertex the first vertex at the same position.
std::vector<std::uint32_t> first_at_place(const std::vector<glm::dvec3>& vertices_m) {
  std::vector<std::uint32_t> order(vertices_m.size()), first(vertices_m.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) {
    const glm::dvec3& p = vertices_m[i];
    return std::tuple(p.x, p.y, p.z, i);
  };
  std::ranges::sort(order, {}, key);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool is_same = k > 0 && vertices_m[order[k]] == vertices_m[order[k - 1]];
    first[order[k]] = is_same ? first[order[k - 1]] : order[k];
  }
  return first;
}

// Returns the distance of a point from the segment a, b.
double distance_m(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double square = glm::dot(along, along);
  const double share = square > 0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0;
  return glm::distance(p, a + share * along);
}

double largest_coordinate(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

}  // namespace

TrueMesh::TrueMesh(TriangleMesh mesh) : nearest_(std::move(mesh)) {
  place_ = first_at_place(nearest_.mesh().vertices_m);
  link_sides();
  weigh_normals();
}

// Links the half-edges along each side in a ring; a half-edge alone lies on the boundary.
void TrueMesh::link_sides() {
  const std::vector<glm::uvec3>& triangles = mesh().triangles;
  struct Side {
    std::uint32_t low, high, half_edge;
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] =
          std::minmax({place_[triangles[t][static_cast<glm::length_t>(k)]],
                       place_[triangles[t][static_cast<glm::length_t>((k + 1) % 3)]]});
      sides.push_back({low, high, 3 * t + k});
    }
  }
  std::ranges::sort(
      sides, {}, [](const Side& side) { return std::tuple(side.low, side.high, side.half_edge); });
  next_.resize(sides.size());
  is_border_.assign(place_.size(), false);
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].low == sides[begin].low &&
           sides[end].high == sides[begin].high)
      ++end;
    for (std::size_t i = begin; i < end; ++i)
      next_[sides[i].half_edge] = sides[i + 1 < end ? i + 1 : begin].half_edge;
    if (end - begin == 1) is_border_[sides[begin].low] = is_border_[sides[begin].high] = true;
  }
}

void TrueMesh::weigh_normals() {
  const TriangleMesh& all = mesh();
  place_normal_.assign(all.vertices_m.size(), glm::dvec3(0));
  for (std::uint32_t t = 0; t < all.triangles.size(); ++t) {
    const glm::dvec3 normal = face_normal(t);
    for (glm::length_t k = 0; k < 3; ++k) {
      const glm::uvec3& triangle = all.triangles[t];
      const glm::dvec3& p = all.vertices_m[triangle[k]];
      place_normal_[place_[triangle[k]]] +=
          angle_between(all.vertices_m[triangle[(k + 1) % 3]] - p,
                        all.vertices_m[triangle[(k + 2) % 3]] - p) *
          normal;
    }
  }
}

// Returns a unit normal; zero for a degenerate triangle.
glm::dvec3 TrueMesh::face_normal(std::uint32_t triangle) const {
  const glm::uvec3& corners = mesh().triangles[triangle];
  const auto& p_m = mesh().vertices_m;
  const glm::dvec3 normal =
      glm::cross(p_m[corners.y] - p_m[corners.x], p_m[corners.z] - p_m[corners.x]);
  const double length = glm::length(normal);
  return length > 0 ? normal / length : glm::dvec3(0);
}

glm::dvec3 TrueMesh::side_normal(std::uint32_t half_edge) const {
  glm::dvec3 sum = face_normal(half_edge / 3);
  for (std::uint32_t other = next_[half_edge]; other != half_edge; other = next_[other])
    sum += face_normal(other / 3);
  return sum;
}

// Points within rounding of a corner or side count as on it, where the normal is equally valid.
TrueMesh::Feature TrueMesh::feature_of(const NearestPoint& nearest) const {
  const glm::uvec3& triangle = mesh().triangles[nearest.triangle];
  std::array<glm::dvec3, 3> corners_m;
  for (glm::length_t k = 0; k < 3; ++k)
    corners_m[static_cast<std::size_t>(k)] = mesh().vertices_m[triangle[k]];
  const double size_m = std::max({glm::distance(corners_m[0], corners_m[1]),
                                  glm::distance(corners_m[1], corners_m[2]),
                                  glm::distance(corners_m[2], corners_m[0])});
  const double tolerance_m =
      1e-7 * size_m + 1e-14 * (largest_coordinate(nearest.point) + nearest.distance_m);
  const auto number = [&](std::uint32_t k) { return 3 * nearest.triangle + k; };
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (glm::distance(nearest.point, corners_m[k]) <= tolerance_m) return {Part::Corner, number(k)};
  }
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (distance_m(nearest.point, corners_m[k], corners_m[(k + 1) % 3]) <= tolerance_m)
      return {Part::Side, number(k)};
  }
  return {Part::Face, number(0)};
}

double TrueMesh::signed_distance_m(const glm::dvec3& p, std::uint32_t& near) const {
  if (!std::isfinite(p.x + p.y + p.z)) return no_sign;
  const NearestPoint nearest = nearest_.nearest(p, near);
  near = nearest.triangle;
  const Feature feature = feature_of(nearest);
  glm::dvec3 normal = face_normal(nearest.triangle);
  bool is_border = false;
  if (feature.part == Part::Side) {
    normal = side_normal(feature.half_edge);
    is_border = next_[feature.half_edge] == feature.half_edge;
  } else if (feature.part == Part::Corner) {
    const auto corner = static_cast<glm::length_t>(feature.half_edge % 3);
    const std::uint32_t place = place_[mesh().triangles[nearest.triangle][corner]];
    normal = place_normal_[place];
    is_border = is_border_[place];
  }
  const double length = glm::length(normal);
  const glm::dvec3 to_p = p - nearest.point;
  const double above_m = length > 0 ? glm::dot(to_p, normal) / length : 0;
  if (is_border) {
    const double aside_m =
        length > 0 ? glm::length(to_p - above_m * normal / length) : nearest.distance_m;
    if (aside_m > std::abs(above_m)) return no_sign;
  }
  return above_m < 0 ? -nearest.distance_m : nearest.distance_m;
}

}  // namespace groundray
