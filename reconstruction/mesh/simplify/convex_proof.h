#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Point of a triangle, and the nearest of some other triangles.
struct ProofCorner {
  glm::dvec3 p_m{0};
  std::uint32_t nearest = 0;
  double excess_m = 0;     ///< distance to that triangle minus the permitted distance
  double tolerance_m = 0;  ///< permitted distance, where it depends on the point
};

/// Proves that every point of a triangle is within a permitted distance of some other triangles.
/// The distance to one of these is convex, and so are convex combinations of two such distances:
/// over a part of the triangle, each is at most its largest value at a corner. If a convex
/// combination of two excesses is nowhere positive, then at each point at least one of the two is
/// not. Parts for which this fails are split, where the nearest triangle changes or in halves.
/// @tparam Target  the other triangles: `ProofCorner corner(a, b, share)` evaluates the point at a
///                 fraction of the way between two corners, `double excess_m(corner, triangle)`
///                 returns the excess for any of the triangles, and `use(triangle)` is called for
///                 all that a proof relies on.
template <typename Target>
class ConvexProof {
 public:
  /// Returns true if the proof succeeds with at most `most_parts` parts. `first` are the triangle's
  /// corners.
  bool holds(const std::array<ProofCorner, 3>& first, std::size_t most_parts, Target& target) {
    parts_.clear();
    for (const ProofCorner& corner : first) {
      if (!(corner.excess_m <= 0)) return false;
    }
    parts_.push_back({first});
    for (std::size_t looked_at = 1; !parts_.empty(); looked_at += 2) {
      const Part part = parts_.back();
      parts_.pop_back();
      if (is_near(part.corners, target)) continue;
      if (looked_at >= most_parts || !split(part, target)) return false;
    }
    return true;
  }

 private:
  struct Part {
    std::array<ProofCorner, 3> corners;
    int depth = 0;
  };
  using Row = std::array<double, 3>;

  static double largest(const Row& row) { return std::max({row[0], row[1], row[2]}); }

  // Returns true if a convex combination of two rows has no positive entry. If there is one, there
  // is also one with a zero entry.
  static bool can_mix(const Row& a, const Row& b) {
    for (std::size_t i = 0; i < 3; ++i) {
      if ((a[i] > 0) == (b[i] > 0)) continue;
      const double share = a[i] / (a[i] - b[i]);  // of b
      double most = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        if (k != i) most = std::max(most, (1 - share) * a[k] + share * b[k]);
      }
      if (!(most > 0)) return true;
    }
    return false;
  }

  bool is_near(const std::array<ProofCorner, 3>& part, Target& target) const {
    std::array<Row, 3> rows;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t triangle = part[k].nearest;
      for (std::size_t i = 0; i < 3; ++i) {
        rows[k][i] =
            part[i].nearest == triangle ? part[i].excess_m : target.excess_m(part[i], triangle);
      }
      if (largest(rows[k]) <= 0) {
        target.use(triangle);
        return true;
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t other = (k + 1) % 3;
      if (part[k].nearest == part[other].nearest || !can_mix(rows[k], rows[other])) continue;
      target.use(part[k].nearest);
      target.use(part[other].nearest);
      return true;
    }
    return false;
  }

  static double square_m2(const ProofCorner& a, const ProofCorner& b) {
    const glm::dvec3 along = b.p_m - a.p_m;
    return glm::dot(along, along);
  }

  // Returns the position on an edge at which the triangles of both ends are about equally good; 0
  // if that is at an end.
  static double crossing(const ProofCorner& a, const ProofCorner& b, const Target& target) {
    if (a.nearest == b.nearest) return 0;
    const double more_a = target.excess_m(a, b.nearest) - a.excess_m;
    const double more_b = target.excess_m(b, a.nearest) - b.excess_m;
    const double share = more_a / (more_a + more_b);
    return share > 0 && share < 1 ? share : 0;
  }

  // Cuts the longest of the edges where the nearest triangle changes; every fourth time the longest
  // of all, since parts could otherwise become ever narrower. Returns true if the point there is
  // within the permitted distance.
  bool split(const Part& part, Target& target) {
    std::size_t edge = 0;
    double longest = -1, share = 0.5;
    for (const bool crosses : {true, false}) {
      if (crosses && part.depth % 4 == 3) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const ProofCorner &a = part.corners[i], &b = part.corners[(i + 1) % 3];
        const double square = square_m2(a, b), at = crosses ? crossing(a, b, target) : 0.5;
        if (square <= longest || !(at > 0)) continue;
        longest = square;
        edge = i;
        share = at;
      }
      if (longest >= 0) break;
    }
    const ProofCorner &a = part.corners[edge], &b = part.corners[(edge + 1) % 3],
                      &c = part.corners[(edge + 2) % 3];
    const ProofCorner cut = target.corner(a, b, share);
    if (!(cut.excess_m <= 0)) return false;
    parts_.push_back({{a, cut, c}, part.depth + 1});
    parts_.push_back({{cut, b, c}, part.depth + 1});
    return true;
  }

  std::vector<Part> parts_;
};

}  // namespace groundray
