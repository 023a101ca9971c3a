#include "reconstruction/mesh/accuracy/cover_bound.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <optional>
#include <utility>

namespace groundray {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Returns twice the area of a, b, c as seen from above, positive if they turn to the left.
double turn(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Points in a frame whose z axis is the viewing direction.
using Seen = std::array<glm::dvec3, 3>;

/// Polygon that results from clipping a triangle.
struct Outline {
  std::array<glm::dvec3, 9> points;
  std::size_t count = 0;

  void add(const glm::dvec3& p) { points[count++] = p; }

  /// Returns the part to the left of a, b.
  Outline left_of(const glm::dvec3& a, const glm::dvec3& b) const {
    Outline kept;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 &p = points[i], &q = points[(i + 1) % count];
      const double at_p = turn(a, b, p), at_q = turn(a, b, q);
      if (at_p >= 0) kept.add(p);
      if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0))
        kept.add(p + at_p / (at_p - at_q) * (q - p));
    }
    return kept;
  }
};

}  // namespace

CoverBound::CoverBound(const TriangleMesh& mesh)
    : mesh_(mesh), around_(triangles_at_vertices(mesh)) {
  for (const glm::dvec3& p : mesh.vertices_m) {
    const glm::dvec3 away = glm::abs(p);
    size_m_ = std::max({size_m_, away.x, away.y, away.z});
  }
}

/// Traversal of the mesh's triangles over all edges that cross the query triangle (`below_`) as
/// seen along the direction. The query triangle's projection is shrunk slightly, by a millionth of
/// its size at most, because the boundaries of both surfaces may coincide. If each edge that
/// crosses it has a triangle on either side, only isolated points could be uncovered, and therefore
/// none is: each point has a point of the mesh along the direction, no farther than at the corners
/// of the intersection of two triangles.
class CoverBound::Walk {
  /// Set of numbers in the order of insertion.
  class NumberSet {
   public:
    std::size_t size() const { return numbers_.size(); }
    std::uint32_t operator[](std::size_t i) const { return numbers_[i]; }

    void add(std::uint32_t number) {
      if (2 * numbers_.size() >= slots_.size()) grow();
      if (put(number)) numbers_.push_back(number);
    }

   private:
    static constexpr std::uint32_t empty = std::numeric_limits<std::uint32_t>::max();

    bool put(std::uint32_t number) {
      std::size_t slot = std::size_t{number} * 2654435761u & (slots_.size() - 1);
      while (slots_[slot] != empty && slots_[slot] != number)
        slot = (slot + 1) & (slots_.size() - 1);
      return std::exchange(slots_[slot], number) == empty;
    }

    void grow() {
      slots_.assign(std::max<std::size_t>(64, 4 * slots_.size()), empty);
      for (const std::uint32_t number : numbers_) put(number);
    }

    std::vector<std::uint32_t> numbers_, slots_;
  };

 public:
  Walk(const CoverBound& cover, const std::array<glm::dvec3, 3>& corners,
       const glm::dvec3& direction, double shrunk_m)
      : cover_(cover), middle_((corners[0] + corners[1] + corners[2]) / 3.0) {
    up_ = glm::normalize(direction);
    const glm::dvec3 aside = std::abs(up_.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    right_ = glm::normalize(glm::cross(aside, up_));
    ahead_ = glm::cross(up_, right_);
    for (std::size_t k = 0; k < 3; ++k) {
      below_[k] = seen(corners[k]);
      radius_m_ = std::max(radius_m_, glm::length(below_[k]));
    }
    const double shrunk = std::clamp(shrunk_m / radius_m_, 1e-10, 1e-6);
    for (glm::dvec3& corner : below_) corner *= 1 - shrunk;
    rest_m_ = 2 * shrunk * radius_m_;
    if (turn(below_[0], below_[1], below_[2]) < 0) std::swap(below_[1], below_[2]);
    const glm::dvec3 ab = below_[1] - below_[0], ac = below_[2] - below_[0];
    const double area = ab.x * ac.y - ab.y * ac.x;
    slope_ = {(ab.z * ac.y - ac.z * ab.y) / area, (ac.z * ab.x - ab.z * ac.x) / area};
  }

  /// Returns an upper bound of the distance minus `most_m` of the mesh's triangle, over all points;
  /// infinity if it exceeds `enough_m`.
  template <typename Most>
  double excess_m(std::uint32_t start, const Most& most_m, double enough_m,
                  std::size_t most_triangles) {
    if (!(turn(below_[0], below_[1], below_[2]) > rounding(below_))) return infinity;
    found_.add(start);
    for (std::size_t next = 0; next < found_.size(); ++next) {
      const std::uint32_t triangle = found_[next];
      if (!go_on_from(triangle, most_m(triangle)) || !is_met_) return infinity;
      if (!(excess_m_ <= enough_m) || found_.size() > most_triangles) return infinity;
    }
    return excess_m_;
  }

 private:
  glm::dvec3 seen(const glm::dvec3& p) const {
    const glm::dvec3 from = p - middle_;
    return {glm::dot(from, right_), glm::dot(from, ahead_), glm::dot(from, up_)};
  }

  /// Returns a bound of the rounding error of areas between these points and the query triangle.
  double rounding(const Seen& points) const {
    double far_m = radius_m_;
    for (const glm::dvec3& p : points) far_m = std::max(far_m, std::abs(p.x) + std::abs(p.y));
    return 64 * std::numeric_limits<double>::epsilon() * (cover_.size_m_ + far_m) * far_m;
  }

  /// Evaluates a triangle's heights and adds the triangles beyond its edges. Returns false if that
  /// is impossible.
  bool go_on_from(std::uint32_t triangle, double most_m) {
    const glm::uvec3& t = cover_.mesh_.triangles[triangle];
    Seen p;
    for (int k = 0; k < 3; ++k)
      p[static_cast<std::size_t>(k)] = seen(cover_.mesh_.vertices_m[t[k]]);
    const double slack = rounding(p);
    if (!(std::abs(turn(p[0], p[1], p[2])) > slack)) return false;
    take_heights(p, most_m);
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 &a = p[static_cast<std::size_t>(k)],
                       &b = p[static_cast<std::size_t>((k + 1) % 3)];
      if (!may_cross(a, b, slack)) continue;
      const double inner = turn(a, b, p[static_cast<std::size_t>((k + 2) % 3)]);
      const auto beyond = across(triangle, t[k], t[(k + 1) % 3], inner);
      if (!beyond) return false;
      found_.add(*beyond);
    }
    return true;
  }

  void take_heights(const Seen& p, double most_m) {
    Outline common;
    for (const glm::dvec3& corner : p) common.add(corner);
    for (std::size_t k = 0; k < 3; ++k) common = common.left_of(below_[k], below_[(k + 1) % 3]);
    is_met_ = is_met_ || common.count > 2;
    for (std::size_t i = 0; i < common.count; ++i) {
      const glm::dvec3& q = common.points[i];
      const double under =
          below_[0].z + slope_.x * (q.x - below_[0].x) + slope_.y * (q.y - below_[0].y);
      const double height_m = std::abs(q.z - under) + rest_m_;
      excess_m_ = std::max(excess_m_, height_m - most_m);
    }
  }

  /// Returns true if an edge crosses the query triangle; possibly also if it only comes near.
  bool may_cross(const glm::dvec3& a, const glm::dvec3& b, double slack) const {
    double low = infinity, high = -infinity;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 &from = below_[k], &to = below_[(k + 1) % 3];
      if (turn(from, to, a) < -slack && turn(from, to, b) < -slack) return false;
      low = std::min(low, turn(a, b, from));
      high = std::max(high, turn(a, b, from));
    }
    return !(low > slack || high < -slack);
  }

  /// Returns a triangle on the other side of an edge, if there is one.
  std::optional<std::uint32_t> across(std::uint32_t triangle, std::uint32_t a, std::uint32_t b,
                                      double inner) const {
    const auto& at = cover_.mesh_.vertices_m;
    const glm::dvec3 begin = seen(at[a]), end = seen(at[b]);
    for (const std::uint32_t other : cover_.around_.at(a)) {
      const glm::uvec3& t = cover_.mesh_.triangles[other];
      if (other == triangle || (t.x != b && t.y != b && t.z != b)) continue;
      for (int k = 0; k < 3; ++k) {
        if (t[k] == a || t[k] == b) continue;
        const glm::dvec3 apex = seen(at[t[k]]);
        const double outer = turn(begin, end, apex), slack = rounding({begin, end, apex});
        if (inner > 0 ? outer < -slack : outer > slack) return other;
      }
    }
    return std::nullopt;
  }

  const CoverBound& cover_;
  glm::dvec3 middle_, right_{0}, ahead_{0}, up_{0};
  Seen below_{};
  glm::dvec2 slope_{0};
  double radius_m_ = 0, rest_m_ = 0, excess_m_ = -infinity;
  bool is_met_ = false;
  NumberSet found_;
};

double CoverBound::bound_m(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& direction,
                           std::uint32_t start) const {
  if (!(glm::dot(direction, direction) > 0)) return infinity;
  const auto nothing = [](std::uint32_t) { return 0.0; };
  return Walk(*this, corners, direction, infinity).excess_m(start, nothing, infinity, 128);
}

bool CoverBound::is_within(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& direction,
                           std::uint32_t start,
                           const std::function<double(std::uint32_t)>& most_m) const {
  if (!(glm::dot(direction, direction) > 0)) return false;
  return Walk(*this, corners, direction, 1e-3 * most_m(start)).excess_m(start, most_m, 0, 4096) <=
         0;
}

}  // namespace groundray
