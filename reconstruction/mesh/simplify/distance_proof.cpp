#include "reconstruction/mesh/simplify/distance_proof.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>

#include "core/model/model.h"
#include "reconstruction/mesh/accuracy/largest_distance.h"

namespace groundray {
namespace {

constexpr std::size_t most_uncovered_parts = 64;  // where there is no cover

constexpr std::size_t most_split_pieces = 200'000;  // split where the nearest triangle changes

/// Tests one triangle after another.
class Prover {
 public:
  /// @param cover  of the mesh of `to`.
  Prover(const ClosestPoint& to, const CoverBound& cover, double most_m, double rounding_m)
      : to_(to),
        near_(to, cover, [most_m](std::uint32_t) { return most_m; }),
        most_m_(most_m),
        rounding_m_(rounding_m) {}

  /// Returns the farthest point found; its distance is negative if the whole triangle is proved
  /// near.
  Beyond look_at(const TriangleMesh& from, std::uint32_t triangle) {
    const glm::uvec3& t = from.triangles[triangle];
    const std::array<glm::dvec3, 3> corners_m{from.vertices_m[t.x], from.vertices_m[t.y],
                                              from.vertices_m[t.z]};
    if (near_.holds(corners_m, hint_)) return {triangle, -1, 0};
    hint_ = near_.farthest().triangle;
    const Beyond found{triangle, near_.farthest().distance_m, hint_};
    return found.distance_m > most_m_ ? found : search(corners_m, found);
  }

 private:
  // Searches for a point that is too far, and for a proof that there is none. Nearer points are
  // ignored, and the search stops at the first point that is too far.
  Beyond search(const std::array<glm::dvec3, 3>& corners_m, const Beyond& found) const {
    const SearchLimits limits{.tolerance_m = 1e-3 * most_m_,
                              .rounding_m = rounding_m_,
                              .most_pieces = most_split_pieces,
                              .enough_m = most_m_};
    FarthestProbe so_far;
    so_far.probe.distance_m = most_m_ - limits.tolerance_m;
    const SearchPiece piece{
        .corners = corners_m, .triangle = found.triangle, .near = found.nearest};
    const FarthestProbe farthest = find_farthest({piece}, to_, so_far, limits);
    if (farthest.at_most_m <= most_m_) return {found.triangle, -1, 0};
    if (!(farthest.probe.distance_m > found.distance_m)) return found;
    return {found.triangle, farthest.probe.distance_m, farthest.probe.nearest};
  }

  const ClosestPoint& to_;
  NearSurface near_;
  double most_m_, rounding_m_;
  std::uint32_t hint_ = 0;
};

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

std::vector<Beyond> find_beyond(const TriangleMesh& from, const ClosestPoint& to, double most_m) {
  const ModelBounds bounds = bounds_of(to.mesh());
  const double rounding_m = 1e-14 * glm::length(bounds.high_m - bounds.low_m);
  const CoverBound cover(to.mesh());
  std::vector<Beyond> all(from.triangles.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, all.size(), 64), [&](const auto& range) {
    Prover prover(to, cover, most_m, rounding_m);
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      all[i] = prover.look_at(from, static_cast<std::uint32_t>(i));
  });
  std::erase_if(all, [](const Beyond& beyond) { return beyond.distance_m < 0; });
  return all;
}

}  // namespace groundray
