#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/accuracy/cover_bound.h"
#include "reconstruction/mesh/simplify/convex_proof.h"

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

/// Triangle that is not proved to be near enough to a surface.
struct Beyond {
  std::uint32_t triangle = 0;
  double distance_m = 0;      ///< of its farthest point found
  std::uint32_t nearest = 0;  ///< triangle of the surface nearest to that point
};

/// Returns, in order, the triangles of a surface that have a point farther than `most_m` from
/// another surface, or for which this cannot be decided, as within a thousandth of it. Every point
/// of all other triangles is within `most_m`, except for rounding. The result does not depend on
/// the number of threads.
/// @param from  in the frame of `to`.
/// @see find_farthest, which decides where a subdivision into a few parts does not.
std::vector<Beyond> find_beyond(const TriangleMesh& from, const ClosestPoint& to, double most_m);

}  // namespace groundray
