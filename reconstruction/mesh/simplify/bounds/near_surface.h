#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/accuracy/cover_bound.h"
#include "reconstruction/mesh/simplify/bounds/convex_proof.h"

namespace groundray {

/// Proves that triangles are near enough to a surface: at each point as near as the surface's
/// triangle there allows.
class NearSurface {
 public:
  /// @param to      must outlive this, as `cover` must, which is of the same mesh.
  /// @param most_m  distance that a triangle of the surface allows, m.
  NearSurface(const ClosestPoint& to, const CoverBound& cover,
              std::function<double(std::uint32_t)> most_m);

  /// Returns true if the proof succeeds for a triangle.
  /// @param near  nearby triangle of the surface.
  bool holds(const std::array<glm::dvec3, 3>& corners_m, std::uint32_t near);

  /// Returns the nearest point to the farthest sample of the latest triangle.
  const NearestPoint& farthest() const noexcept { return farthest_; }

 private:
  friend class ConvexProof<NearSurface>;

  ProofCorner corner(const ProofCorner& a, const ProofCorner& b, double share);
  double excess_m(const ProofCorner& corner, std::uint32_t triangle) const;
  void use(std::uint32_t) const {}

  ProofCorner look_at(const glm::dvec3& p_m, std::uint32_t near);
  bool holds_in_parts(const std::array<glm::dvec3, 3>& corners_m, std::uint32_t near, int deeper);

  const ClosestPoint& to_;
  const CoverBound& cover_;
  std::function<double(std::uint32_t)> most_m_;
  NearestPoint farthest_;
  ConvexProof<NearSurface> proof_;
};

}  // namespace groundray
