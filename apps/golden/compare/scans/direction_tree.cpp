#include "apps/golden/compare/scans/direction_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace groundray::golden {
namespace {

/// Returns the chord of an angle on the unit sphere, enlarged by a bound of its rounding error.
double chord_of(double angle_rad) {
  constexpr double slack = 1 + 1e-12;
  return 2 * std::sin(std::min(angle_rad, std::numbers::pi) / 2) * slack + 1e-15;
}

}  // namespace

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

DirectionTree::DirectionTree(std::vector<glm::dvec3> directions)
    : directions_(std::move(directions)), order_(directions_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  split(0, order_.size(), 0);
}

void DirectionTree::split(std::size_t begin, std::size_t end, int axis) {
  if (end - begin < 2) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(directions_[a][axis], a) < std::pair(directions_[b][axis], b);
  });
  split(begin, middle, (axis + 1) % 3);
  split(middle + 1, end, (axis + 1) % 3);
}

/// Visits every direction that may be within `most_chord`, the nearer half first; `visit` may lower
/// `most_chord`.
template <typename Visit>
void DirectionTree::walk(std::size_t begin, std::size_t end, int axis, const glm::dvec3& direction,
                         const double& most_chord, const Visit& visit) const {
  if (begin == end) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const std::uint32_t index = order_[middle];
  const int next = (axis + 1) % 3;
  const double ahead = direction[axis] - directions_[index][axis];
  visit(index);
  if (ahead <= 0) {
    walk(begin, middle, next, direction, most_chord, visit);
    if (-ahead <= most_chord) walk(middle + 1, end, next, direction, most_chord, visit);
  } else {
    walk(middle + 1, end, next, direction, most_chord, visit);
    if (ahead <= most_chord) walk(begin, middle, next, direction, most_chord, visit);
  }
}

void DirectionTree::for_each_within(const glm::dvec3& direction, double most_rad,
                                    const std::function<void(std::uint32_t, double)>& take) const {
  const double most_chord = chord_of(most_rad);
  walk(0, order_.size(), 0, direction, most_chord, [&](std::uint32_t index) {
    if (glm::distance(direction, directions_[index]) > most_chord) return;
    const double angle_rad = angle_between(direction, directions_[index]);
    if (angle_rad <= most_rad) take(index, angle_rad);
  });
}

double DirectionTree::nearest_beyond(const glm::dvec3& direction, double least_rad) const {
  double best_rad = std::numeric_limits<double>::infinity();
  double most_chord = best_rad;
  walk(0, order_.size(), 0, direction, most_chord, [&](std::uint32_t index) {
    if (glm::distance(direction, directions_[index]) > most_chord) return;
    const double angle_rad = angle_between(direction, directions_[index]);
    if (angle_rad <= least_rad || angle_rad >= best_rad) return;
    best_rad = angle_rad;
    most_chord = chord_of(angle_rad);
  });
  return best_rad;
}

}  // namespace groundray::golden
