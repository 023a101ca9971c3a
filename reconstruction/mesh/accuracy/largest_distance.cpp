#include "reconstruction/mesh/accuracy/largest_distance.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

namespace groundray {
namespace {

// Part of a triangle, with an upper bound of the distances of its points.
struct Piece {
  std::array<Probe, 3> corners;
  double bound_m = std::numeric_limits<double>::infinity();
  std::uint32_t triangle = 0;
  std::uint32_t depth = 0;
};

// Distances of a piece's corners from one triangle.
using Row = std::array<double, 3>;

double largest(const Row& row) { return std::max({row[0], row[1], row[2]}); }

// Returns the minimum, over convex combinations of two rows, of the largest entry. It lies at an
// end or where two entries of the combination are equal.
double least_mixture(const Row& a, const Row& b) {
  double least = std::min(largest(a), largest(b));
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const double share = (a[j] - a[i]) / ((a[j] - a[i]) - (b[j] - b[i]));
    if (!(share > 0 && share < 1)) continue;
    Row mixed;
    for (std::size_t k = 0; k < 3; ++k) mixed[k] = (1 - share) * a[k] + share * b[k];
    least = std::min(least, largest(mixed));
  }
  return least;
}

// Returns an upper bound of the distances over a piece. The distance to a triangle is convex, and
// so are convex combinations of such distances: over a piece, each is at most its largest value at
// a corner. The distance to the surface is at most that to any triangle, and hence at most any
// combination. In addition, each point of a triangle is at most the longest edge over the root of 3
// from its nearest corner, and the distance is 1-Lipschitz.
double bound_of(const ClosestPoint& to, const std::array<Probe, 3>& corners) {
  std::array<Row, 3> rows;
  double square_m2 = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 edge = corners[(i + 1) % 3].p - corners[i].p;
    square_m2 = std::max(square_m2, glm::dot(edge, edge));
  }
  double bound_m = largest({corners[0].distance_m, corners[1].distance_m, corners[2].distance_m}) +
                   std::sqrt(square_m2 / 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t triangle = corners[k].nearest;
    for (std::size_t i = 0; i < 3; ++i) {
      rows[k][i] = corners[i].nearest == triangle ? corners[i].distance_m
                                                  : to.distance_m(corners[i].p, triangle);
    }
    bound_m = std::min(bound_m, largest(rows[k]));
    for (std::size_t before = 0; before < k; ++before) {
      if (corners[before].nearest != triangle)
        bound_m = std::min(bound_m, least_mixture(rows[before], rows[k]));
    }
  }
  return bound_m;
}

// Splits pieces where the nearest triangle changes, so that a piece soon has a single nearest
// triangle and its bound is attained.
class Splitter {
 public:
  Splitter(const ClosestPoint& to, double rounding_m) : to_(to), rounding_m_(rounding_m) {}

  std::vector<Piece> split(const Piece& piece) const {
    const bool may_cross = piece.depth % 4 != 3;  // otherwise pieces could become ever narrower
    if (const auto corner = may_cross ? common_corner(piece) : std::nullopt)
      return split_at(piece, *corner);
    std::size_t edge = 0;
    double share = 0.5, longest = -1;
    for (const bool crosses : {true, false}) {
      for (std::size_t i = 0; i < 3 && (may_cross || !crosses); ++i) {
        const Probe &a = piece.corners[i], &b = piece.corners[(i + 1) % 3];
        if (crosses && !changes(a, b)) continue;
        const double length = glm::length(b.p - a.p);
        if (length <= longest) continue;
        longest = length;
        edge = i;
        share = crosses ? crossing(a, b) : 0.5;
      }
      if (longest >= 0) break;
    }
    return split_edge(piece, edge, share);
  }

 private:
  Probe probe(const glm::dvec3& p, std::uint32_t near) const {
    const NearestPoint nearest = to_.nearest(p, near);
    return {p, nearest.distance_m, nearest.triangle};
  }

  Piece part(const Piece& of, const std::array<Probe, 3>& corners) const {
    return {corners, std::min(of.bound_m, bound_of(to_, corners)), of.triangle, of.depth + 1};
  }

  std::vector<Piece> split_edge(const Piece& piece, std::size_t edge, double share) const {
    const Probe &a = piece.corners[edge], &b = piece.corners[(edge + 1) % 3],
                &c = piece.corners[(edge + 2) % 3];
    const Probe cut = probe((1 - share) * a.p + share * b.p, a.nearest);
    return {part(piece, {a, cut, c}), part(piece, {cut, b, c})};
  }

  std::vector<Piece> split_at(const Piece& piece, const glm::dvec3& p) const {
    const auto& [a, b, c] = piece.corners;
    const Probe cut = probe(p, a.nearest);
    return {part(piece, {a, b, cut}), part(piece, {b, c, cut}), part(piece, {c, a, cut})};
  }

  // Returns true if each end is clearly nearer to its own triangle than to the other's.
  bool changes(const Probe& a, const Probe& b) const {
    return a.nearest != b.nearest && to_.distance_m(a.p, b.nearest) > a.distance_m + rounding_m_ &&
           to_.distance_m(b.p, a.nearest) > b.distance_m + rounding_m_;
  }

  // Returns the position on an edge, 0 to 1, at which the triangles of both ends are equally
  // distant. If the triangles lie in one plane, the squared distances differ by a square that
  // vanishes there; if in two planes, the distances differ linearly. Both estimates are tried
  // before bisection.
  double crossing(const Probe& a, const Probe& b) const {
    const double other_a = to_.distance_m(a.p, b.nearest);
    const double other_b = to_.distance_m(b.p, a.nearest);
    const double gap_a = std::sqrt((other_a - a.distance_m) * (other_a + a.distance_m));
    const double gap_b = std::sqrt((other_b - b.distance_m) * (other_b + b.distance_m));
    const double line_a = other_a - a.distance_m, line_b = other_b - b.distance_m;
    double low = 0, high = 1;
    for (int i = 0; i < 40; ++i) {
      double share = 0.5 * (low + high);
      if (i == 0) share = gap_a / (gap_a + gap_b);
      if (i == 1) share = line_a / (line_a + line_b);
      const glm::dvec3 p = (1 - share) * a.p + share * b.p;
      const double excess = to_.distance_m(p, a.nearest) - to_.distance_m(p, b.nearest);
      if (std::abs(excess) <= 0.1 * rounding_m_) return share;
      (excess < 0 ? low : high) = excess < 0 ? std::max(low, share) : std::min(high, share);
    }
    return 0.5 * (low + high);
  }

  // Returns the point of a piece below a vertex that its nearest triangles share, if it lies
  // inside.
  std::optional<glm::dvec3> common_corner(const Piece& piece) const {
    const auto& [a, b, c] = piece.corners;
    if (a.nearest == b.nearest && b.nearest == c.nearest) return std::nullopt;
    const auto has = [&](const Probe& probe, std::uint32_t vertex) {
      const glm::uvec3& corners = to_.mesh().triangles[probe.nearest];
      return corners.x == vertex || corners.y == vertex || corners.z == vertex;
    };
    const glm::dvec3 ab = b.p - a.p, ac = c.p - a.p, normal = glm::cross(ab, ac);
    const double square = glm::dot(normal, normal);
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = to_.mesh().triangles[a.nearest][k];
      if (!has(b, vertex) || !has(c, vertex)) continue;
      const glm::dvec3 v = to_.mesh().vertices_m[vertex] - a.p;
      const double to_b = glm::dot(glm::cross(v, ac), normal) / square;
      const double to_c = glm::dot(glm::cross(ab, v), normal) / square;
      constexpr double least = 1e-6;  // closer to an edge, the edge is split instead
      if (to_b > least && to_c > least && 1 - to_b - to_c > least)
        return a.p + to_b * ab + to_c * ac;
    }
    return std::nullopt;
  }

  const ClosestPoint& to_;
  double rounding_m_;
};

std::vector<Probe> probe_vertices(const TriangleMesh& from, const ClosestPoint& to) {
  std::vector<Probe> probes(from.vertices_m.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, probes.size(), 256), [&](const auto& range) {
    std::uint32_t near = 0;  // consecutive vertices are often close in space
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const NearestPoint nearest = to.nearest(from.vertices_m[i], near);
      near = nearest.triangle;
      probes[i] = {from.vertices_m[i], nearest.distance_m, nearest.triangle};
    }
  });
  return probes;
}

// Branch and bound. The results of a round are used from the next round on, so that rounds do not
// depend on the scheduling of threads.
class FarthestSearch {
 public:
  FarthestSearch(const ClosestPoint& to, const SearchLimits& limits, const FarthestProbe& so_far)
      : to_(to),
        // Distances that agree to a hundredth of the tolerance need not be distinguished.
        splitter_(to, std::max(limits.rounding_m, 0.01 * limits.tolerance_m)),
        limits_(limits),
        found_(so_far) {}

  FarthestProbe search(std::vector<Piece> pieces) {
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
      pieces[i].bound_m = std::min(pieces[i].bound_m, bound_of(to_, pieces[i].corners));
    });
    for (const Piece& piece : pieces) look_at(piece);
    open_ = std::move(pieces);
    settle();
    while (!open_.empty() && found_.pieces < limits_.most_pieces &&
           found_.probe.distance_m <= limits_.enough_m)
      go_on();
    found_.at_most_m = std::max(found_.at_most_m, found_.probe.distance_m);
    for (const Piece& piece : open_) found_.at_most_m = std::max(found_.at_most_m, piece.bound_m);
    return found_;
  }

 private:
  // Splits the pieces with the largest bounds.
  void go_on() {
    const std::size_t count = std::min(open_.size(), std::max<std::size_t>(4096, open_.size() / 4));
    const auto chosen = open_.end() - static_cast<std::ptrdiff_t>(count);
    std::nth_element(open_.begin(), chosen, open_.end(),
                     [](const Piece& a, const Piece& b) { return a.bound_m < b.bound_m; });
    std::vector<std::vector<Piece>> parts(count);
    const std::size_t first = open_.size() - count;
    tbb::parallel_for(std::size_t{0}, count,
                      [&](std::size_t i) { parts[i] = splitter_.split(open_[first + i]); });
    open_.resize(first);
    for (const std::vector<Piece>& some : parts) {
      for (const Piece& piece : some) look_at(piece);
      open_.insert(open_.end(), some.begin(), some.end());
    }
    settle();
  }

  void look_at(const Piece& piece) {
    ++found_.pieces;
    for (const Probe& corner : piece.corners) {
      if (!(corner.distance_m > found_.probe.distance_m)) continue;
      found_.probe = corner;
      found_.triangle = piece.triangle;
    }
  }

  // Discards pieces that cannot exceed the largest distance found by more than the tolerance.
  void settle() {
    std::erase_if(open_, [&](const Piece& piece) {
      if (piece.bound_m > found_.probe.distance_m + limits_.tolerance_m) return false;
      found_.at_most_m = std::max(found_.at_most_m, piece.bound_m);
      return true;
    });
  }

  const ClosestPoint& to_;
  Splitter splitter_;
  SearchLimits limits_;
  FarthestProbe found_;
  std::vector<Piece> open_;
};

}  // namespace

FarthestProbe find_farthest(const TriangleMesh& from, const ClosestPoint& to,
                            const SearchLimits& limits) {
  const std::vector<Probe> probes = probe_vertices(from, to);
  std::vector<Piece> pieces(from.triangles.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const glm::uvec3& t = from.triangles[i];
    pieces[i].corners = {probes[t.x], probes[t.y], probes[t.z]};
    pieces[i].triangle = static_cast<std::uint32_t>(i);
  }
  return FarthestSearch(to, limits, {.probe = {.distance_m = -1}}).search(std::move(pieces));
}

FarthestProbe find_farthest(const std::vector<SearchPiece>& pieces, const ClosestPoint& to,
                            const FarthestProbe& so_far, const SearchLimits& limits) {
  std::vector<Piece> begun(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
    begun[i].triangle = pieces[i].triangle;
    begun[i].bound_m = pieces[i].at_most_m;
    for (std::size_t k = 0; k < 3; ++k) {
      const NearestPoint nearest = to.nearest(pieces[i].corners[k], pieces[i].near);
      begun[i].corners[k] = {pieces[i].corners[k], nearest.distance_m, nearest.triangle};
    }
  });
  return FarthestSearch(to, limits, so_far).search(std::move(begun));
}

}  // namespace groundray
