#include "terrain/trail/route.h"

// A* is hand-written: its loop has 17 lines, and that of Boost.Graph, which Debian has, needs
// adaptors for a graph that is not stored.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <queue>
#include <tuple>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr int points_across = 512;
constexpr double finest_m = 1;
// Share of the limits that lattice paths may use, because smooth curves through their points vary.
constexpr double share_used = 0.85;

// Directions of up to two steps, 16 in all.
constexpr std::array<glm::ivec2, 16> moves{{{1, 0},
                                            {-1, 0},
                                            {0, 1},
                                            {0, -1},
                                            {1, 1},
                                            {1, -1},
                                            {-1, 1},
                                            {-1, -1},
                                            {2, 1},
                                            {2, -1},
                                            {-2, 1},
                                            {-2, -1},
                                            {1, 2},
                                            {1, -2},
                                            {-1, 2},
                                            {-1, -2}}};

// Lattice of points around both ends, which are points of it.
class RouteLattice {
 public:
  RouteLattice(const std::function<std::optional<double>(glm::dvec2)>& ground, glm::dvec2 from,
               glm::dvec2 to)
      : from_(from) {
    const double distance_m = glm::distance(from, to);
    const double most_m = 2 * distance_m;  // side of the rectangle
    const double pieces =
        std::max(1.0, std::floor(distance_m / std::max(finest_m, most_m / points_across)));
    step_ = (to - from) / pieces;
    end_ = {static_cast<int>(pieces), 0};
    const int margin = static_cast<int>(pieces / 2) + 2;
    low_ = {-margin, -2 * margin};
    size_ = {end_.x + 2 * margin + 1, 4 * margin + 1};
    heights_m_.resize(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y));
    for (int y = 0; y < size_.y; ++y) {
      for (int x = 0; x < size_.x; ++x) {
        const glm::ivec2 point = low_ + glm::ivec2(x, y);
        heights_m_[index(point)] =
            ground(place(point)).value_or(std::numeric_limits<double>::quiet_NaN());
      }
    }
  }

  glm::ivec2 end() const { return end_; }
  std::size_t count() const { return heights_m_.size(); }
  bool holds(glm::ivec2 point) const {
    const glm::ivec2 at = point - low_;
    return at.x >= 0 && at.y >= 0 && at.x < size_.x && at.y < size_.y;
  }
  std::size_t index(glm::ivec2 point) const {
    const glm::ivec2 at = point - low_;
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(at.x);
  }
  glm::ivec2 point(std::size_t index) const {
    const auto columns = static_cast<std::size_t>(size_.x);
    return low_ + glm::ivec2(index % columns, index / columns);
  }
  glm::dvec2 place(glm::ivec2 point) const {
    const glm::dvec2 across(-step_.y, step_.x);
    return from_ + static_cast<double>(point.x) * step_ + static_cast<double>(point.y) * across;
  }
  double height_m(glm::ivec2 point) const {
    return holds(point) ? heights_m_[index(point)] : std::numeric_limits<double>::quiet_NaN();
  }
  // Length of a move, metres.
  double length_m(glm::ivec2 move) const {
    return glm::length(step_) * glm::length(glm::dvec2(move));
  }

  // Returns the cost of a move, metres; infinite if it is too steep or has no ground.
  double cost_m(glm::ivec2 at, glm::ivec2 move, const RouteLimits& limits) const {
    const double length = length_m(move);
    const double grade = (height_m(at + move) - height_m(at)) / length / limits.most_grade;
    const glm::ivec2 left(-move.y, move.x);
    const glm::ivec2 middle = at + move / 2;
    const double side =
        (height_m(middle + left) - height_m(middle - left)) / (2 * length) / limits.most_side_slope;
    const bool is_possible = std::abs(grade) <= share_used && !(std::abs(side) > share_used);
    if (!is_possible) return std::numeric_limits<double>::infinity();
    return length * (1 + 4 * grade * grade + (std::isnan(side) ? 0 : side * side));
  }

 private:
  glm::dvec2 from_, step_{0};
  glm::ivec2 low_{0}, size_{0}, end_{0};
  std::vector<double> heights_m_;
};

// Removes points that are within `off_m` of the polyline through those that remain
// (Ramer-Douglas-Peucker).
void simplify(const std::vector<glm::dvec2>& points, std::size_t first, std::size_t last,
              double off_m, std::vector<glm::dvec2>& kept) {
  const glm::dvec2 chord = points[last] - points[first];
  double most_m = 0;
  std::size_t farthest = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const glm::dvec2 from = points[i] - points[first];
    const double off = std::abs(chord.x * from.y - chord.y * from.x) / glm::length(chord);
    if (off > most_m) std::tie(most_m, farthest) = std::tuple(off, i);
  }
  if (most_m > off_m) {
    simplify(points, first, farthest, off_m, kept);
    simplify(points, farthest, last, off_m, kept);
  } else {
    kept.push_back(points[last]);
  }
}

}  // namespace

std::vector<glm::dvec2> find_route(const std::function<std::optional<double>(glm::dvec2)>& ground,
                                   glm::dvec2 from, glm::dvec2 to, const RouteLimits& limits,
                                   glm::dvec2 origin_w_m) {
  const RouteLattice lattice(ground, from, to);
  const glm::ivec2 end = lattice.end();
  std::vector<double> costs_m(lattice.count(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> before(lattice.count(), lattice.count());
  // Entries are ordered by cost and index, so that the route is the same everywhere.
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const std::size_t start = lattice.index({0, 0}), goal = lattice.index(end);
  const auto rest_m = [&](glm::ivec2 point) { return lattice.length_m(end - point); };
  costs_m[start] = 0;
  open.emplace(rest_m({0, 0}), start);
  std::size_t nearest = start;
  while (!open.empty()) {
    const auto [estimate_m, at] = open.top();
    open.pop();
    const glm::ivec2 point = lattice.point(at);
    if (at == goal) break;
    if (estimate_m > costs_m[at] + rest_m(point)) continue;  // an older entry
    if (rest_m(point) < rest_m(lattice.point(nearest))) nearest = at;
    for (const glm::ivec2 move : moves) {
      if (!lattice.holds(point + move)) continue;
      const double cost_m = costs_m[at] + lattice.cost_m(point, move, limits);
      const std::size_t next = lattice.index(point + move);
      if (!(cost_m < costs_m[next])) continue;
      costs_m[next] = cost_m;
      before[next] = at;
      open.emplace(cost_m + rest_m(point + move), next);
    }
  }
  if (std::isinf(costs_m[goal])) {
    const glm::dvec2 p_W = lattice.place(lattice.point(nearest)) + origin_w_m;
    throw Error(
        "there is no way to ({:.1f}, {:.1f}) m in W with grades of at most {:.1f} degrees; from "
        "the start, it leads no nearer than ({:.1f}, {:.1f}) m: move the ends, or allow steeper "
        "grades or higher banks",
        to.x + origin_w_m.x, to.y + origin_w_m.y,
        math::atan(limits.most_grade) * 180 / std::numbers::pi, p_W.x, p_W.y);
  }
  std::vector<glm::dvec2> path{to};
  for (std::size_t at = before[goal]; at < lattice.count(); at = before[at])
    path.push_back(lattice.place(lattice.point(at)));
  path.back() = from;
  std::ranges::reverse(path);
  std::vector<glm::dvec2> waypoints{from};
  simplify(path, 0, path.size() - 1, lattice.length_m({1, 0}), waypoints);
  return waypoints;
}

}  // namespace groundray
