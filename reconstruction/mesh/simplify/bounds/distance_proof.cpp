#include "reconstruction/mesh/simplify/bounds/distance_proof.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "core/model/model.h"
#include "reconstruction/mesh/accuracy/cover_bound.h"
#include "reconstruction/mesh/accuracy/largest_distance.h"
#include "reconstruction/mesh/simplify/bounds/near_surface.h"

namespace groundray {
namespace {

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
