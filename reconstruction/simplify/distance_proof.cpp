#include "reconstruction/simplify/distance_proof.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <limits>

#include "core/model.h"
#include "reconstruction/accuracy/largest_distance.h"

namespace groundray {
namespace {

constexpr int few_parts = 32;                  // that are looked at in passing
constexpr std::size_t most_parts = 2'000'000;  // that are split where the nearest triangle changes

/// A corner of a part of a triangle.
struct Corner {
  glm::dvec3 p_m{0};
  NearestPoint nearest;
};

using Part = std::array<Corner, 3>;

/// Looks at one triangle after another.
class Prover {
 public:
  Prover(const ClosestPoint& to, double most_m, double rounding_m)
      : to_(to), most_m_(most_m), rounding_m_(rounding_m) {}

  /// Returns the farthest point found if not all are proved to be near.
  Beyond look_at(const TriangleMesh& from, std::uint32_t triangle) {
    found_ = {triangle, -1, 0};
    const glm::uvec3& t = from.triangles[triangle];
    parts_.clear();
    parts_.push_back(
        {corner(from.vertices_m[t.x]), corner(from.vertices_m[t.y]), corner(from.vertices_m[t.z])});
    int looked_at = 1;
    while (!parts_.empty() && found_.distance_m <= most_m_ && looked_at < few_parts) {
      const Part part = parts_.back();
      parts_.pop_back();
      if (is_near(part)) continue;
      split(part);
      looked_at += 2;
    }
    if (found_.distance_m <= most_m_ && (parts_.empty() || search(from, t, triangle)))
      found_.distance_m = -1;
    return found_;
  }

 private:
  // Whether a search proves that no point is too far. It need not find what is nearer than that.
  bool search(const TriangleMesh& from, const glm::uvec3& t, std::uint32_t triangle) {
    const SearchLimits limits{
        .tolerance_m = 1e-3 * most_m_, .rounding_m = rounding_m_, .most_pieces = most_parts};
    FarthestProbe so_far;
    so_far.probe.distance_m = most_m_ - limits.tolerance_m;
    const SearchPiece piece{
        .corners = {from.vertices_m[t.x], from.vertices_m[t.y], from.vertices_m[t.z]},
        .triangle = triangle,
        .near = near_,
        .at_most_m = std::numeric_limits<double>::infinity()};
    const FarthestProbe farthest = find_farthest({piece}, to_, so_far, limits);
    if (farthest.at_most_m <= most_m_) return true;
    if (farthest.probe.distance_m > found_.distance_m)
      found_ = {triangle, farthest.probe.distance_m, farthest.probe.nearest};
    return false;
  }

  Corner corner(const glm::dvec3& p_m) {
    const Corner found{p_m, to_.nearest(p_m, near_)};
    near_ = found.nearest.triangle;
    if (found.nearest.distance_m > found_.distance_m) {
      found_.distance_m = found.nearest.distance_m;
      found_.nearest = near_;
    }
    return found;
  }

  // The distance from one triangle is convex, and so are mixtures of the distances from two: those
  // of a part are at most the largest at its corners.
  bool is_near(const Part& part) const {
    std::array<std::array<double, 3>, 3> rows{};
    for (std::size_t k = 0; k < 3; ++k) {
      bool are_near = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t triangle = part[k].nearest.triangle;
        rows[k][i] = part[i].nearest.triangle == triangle ? part[i].nearest.distance_m
                                                          : to_.distance_m(part[i].p_m, triangle);
        are_near = are_near && rows[k][i] <= most_m_;
      }
      if (are_near) return true;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      bool are_near = true;
      for (std::size_t i = 0; i < 3; ++i)
        are_near = are_near && 0.5 * (rows[k][i] + rows[(k + 1) % 3][i]) <= most_m_;
      if (are_near) return true;
    }
    return false;
  }

  void split(const Part& part) {
    std::size_t edge = 0;
    double longest = -1;
    for (std::size_t i = 0; i < 3; ++i) {
      const double length = glm::length(part[(i + 1) % 3].p_m - part[i].p_m);
      if (length <= longest) continue;
      longest = length;
      edge = i;
    }
    const Corner &a = part[edge], &b = part[(edge + 1) % 3], &c = part[(edge + 2) % 3];
    near_ = a.nearest.triangle;
    const Corner middle = corner(0.5 * (a.p_m + b.p_m));
    parts_.push_back({a, middle, c});
    parts_.push_back({middle, b, c});
  }

  const ClosestPoint& to_;
  double most_m_, rounding_m_;
  std::uint32_t near_ = 0;
  Beyond found_;
  std::vector<Part> parts_;
};

}  // namespace

std::vector<Beyond> find_beyond(const TriangleMesh& from, const ClosestPoint& to, double most_m) {
  const ModelBounds bounds = bounds_of(to.mesh());
  const double rounding_m = 1e-14 * glm::length(bounds.high_m - bounds.low_m);
  std::vector<Beyond> all(from.triangles.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, all.size(), 64), [&](const auto& range) {
    Prover prover(to, most_m, rounding_m);
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      all[i] = prover.look_at(from, static_cast<std::uint32_t>(i));
  });
  std::erase_if(all, [](const Beyond& beyond) { return beyond.distance_m < 0; });
  return all;
}

}  // namespace groundray
