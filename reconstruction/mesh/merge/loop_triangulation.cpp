#include "reconstruction/mesh/merge/loop_triangulation.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <numeric>

namespace groundray {
namespace {

constexpr std::size_t most_corners = 40;  // of the dynamic program, whose cost is cubic

/// Cost of a triangulation: first the area that is turned over, then the squared lengths.
struct Cost {
  double turned_m2 = 0, squares_m2 = 0;

  Cost operator+(const Cost& b) const {
    return {turned_m2 + b.turned_m2, squares_m2 + b.squares_m2};
  }
  bool operator<(const Cost& b) const {
    return turned_m2 != b.turned_m2 ? turned_m2 < b.turned_m2 : squares_m2 < b.squares_m2;
  }
};

/// Corners of a loop and the costs of triangles between them.
class Loop {
 public:
  Loop(std::span<const glm::dvec3> corners, const glm::dvec3& normal)
      : corners_(corners), normal_(normal) {}

  std::size_t size() const { return corners_.size(); }

  double square_m2(std::size_t a, std::size_t b) const {
    const glm::dvec3 along = corners_[b] - corners_[a];
    return glm::dot(along, along);
  }

  /// Returns the cost of a triangle's orientation; one without area costs as much as a small one
  /// that is turned over.
  double turned_m2(std::size_t a, std::size_t b, std::size_t c) const {
    constexpr double flat = 1e-6;  // height relative to the longest edge
    const double area =
        glm::dot(glm::cross(corners_[b] - corners_[a], corners_[c] - corners_[a]), normal_);
    const double square = std::max({square_m2(a, b), square_m2(b, c), square_m2(c, a)});
    return area > flat * square ? 0 : flat * square - area;
  }

 private:
  std::span<const glm::dvec3> corners_;
  glm::dvec3 normal_;
};

LoopTriangles by_program(const Loop& loop) {
  const std::size_t n = loop.size();
  std::vector<Cost> best(n * n);  // of the part from corner i to corner k
  std::vector<std::size_t> apex(n * n);
  for (std::size_t span = 2; span < n; ++span) {
    for (std::size_t i = 0, k = span; k < n; ++i, ++k) {
      best[i * n + k] = {std::numeric_limits<double>::infinity(), 0};
      const double square_m2 = i == 0 && k + 1 == n ? 0 : loop.square_m2(i, k);
      for (std::size_t m = i + 1; m < k; ++m) {
        const Cost cost =
            best[i * n + m] + best[m * n + k] + Cost{loop.turned_m2(i, m, k), square_m2};
        if (m == i + 1 || cost < best[i * n + k]) {
          best[i * n + k] = cost;
          apex[i * n + k] = m;
        }
      }
    }
  }
  LoopTriangles out{.triangles = {}, .is_upright = !(best[n - 1].turned_m2 > 0)};
  std::vector<glm::uvec2> parts{{0, static_cast<unsigned>(n - 1)}};
  while (!parts.empty()) {
    const glm::uvec2 part = parts.back();
    parts.pop_back();
    if (part.y - part.x < 2) continue;
    const auto m = static_cast<unsigned>(apex[part.x * n + part.y]);
    out.triangles.emplace_back(part.x, m, part.y);
    parts.emplace_back(part.x, m);
    parts.emplace_back(m, part.y);
  }
  return out;
}

LoopTriangles by_ears(const Loop& loop) {
  std::vector<unsigned> left(loop.size());
  std::iota(left.begin(), left.end(), 0u);
  LoopTriangles out;
  while (left.size() >= 3) {
    const std::size_t n = left.size();
    Cost least;
    std::size_t ear = n;
    for (std::size_t i = 0; i < n; ++i) {
      const unsigned before = left[(i + n - 1) % n], after = left[(i + 1) % n];
      const Cost cost{loop.turned_m2(before, left[i], after), loop.square_m2(before, after)};
      if (ear == n || cost < least) {
        least = cost;
        ear = i;
      }
    }
    out.triangles.emplace_back(left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]);
    out.is_upright = out.is_upright && !(least.turned_m2 > 0);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  return out;
}

}  // namespace

LoopTriangles triangulate_loop(std::span<const glm::dvec3> loop, const glm::dvec3& normal) {
  const Loop corners(loop, normal);
  return corners.size() <= most_corners ? by_program(corners) : by_ears(corners);
}

}  // namespace groundray
