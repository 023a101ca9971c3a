#include "core/geometry/line_field.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

namespace groundray {
namespace {

double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }

// Cubic from p to q with velocities v and w, at t from 0 to 1.
struct Hermite {
  glm::dvec2 p, v, q, w;

  glm::dvec2 at(double t) const {
    const double r = 1 - t;
    return r * r * (1 + 2 * t) * p + t * r * r * v + t * t * (3 - 2 * t) * q - t * t * r * w;
  }
  glm::dvec2 velocity(double t) const {
    const double r = 1 - t;
    return 6 * t * r * (q - p) + r * (1 - 3 * t) * v + t * (3 * t - 2) * w;
  }
  glm::dvec2 acceleration(double t) const {
    return (6 - 12 * t) * (q - p) + (6 * t - 4) * v + (6 * t - 2) * w;
  }
};

}  // namespace

LineField::LineField(TangentLine line, double reach_m) : line_(std::move(line)), reach_m_(reach_m) {
  const std::vector<glm::dvec2>& points = line_.points_m;
  // The nearest of the points is at most half a spacing farther away than the line.
  const double far_m = reach_m + line_.spacing_m;
  glm::dvec2 low = points[0], high = points[0];
  for (const glm::dvec2& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  bins_.corner_m = low - far_m;
  const glm::dvec2 extent_m = high - low + 2 * far_m;
  // About as many bins as four times the points, so that neither takes much memory.
  const double fewest_m =
      std::sqrt(extent_m.x * extent_m.y / (4.0 * static_cast<double>(points.size()) + 64));
  bins_.size_m = std::max({fewest_m, reach_m / 4, line_.spacing_m});
  bins_.count = glm::ivec2(extent_m / bins_.size_m) + 1;
  const auto for_each_bin = [&](const auto& act) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::ivec2 first((points[i] - far_m - bins_.corner_m) / bins_.size_m);
      const glm::ivec2 last = glm::min(
          glm::ivec2((points[i] + far_m - bins_.corner_m) / bins_.size_m), bins_.count - 1);
      for (int y = std::max(first.y, 0); y <= last.y; ++y) {
        for (int x = std::max(first.x, 0); x <= last.x; ++x)
          act(static_cast<std::size_t>(y) * static_cast<std::size_t>(bins_.count.x) +
                  static_cast<std::size_t>(x),
              static_cast<std::uint32_t>(i));
      }
    }
  };
  bins_.begins.assign(
      static_cast<std::size_t>(bins_.count.x) * static_cast<std::size_t>(bins_.count.y) + 1, 0);
  for_each_bin([&](std::size_t bin, std::uint32_t) { ++bins_.begins[bin + 1]; });
  for (std::size_t bin = 1; bin < bins_.begins.size(); ++bin)
    bins_.begins[bin] += bins_.begins[bin - 1];
  bins_.points.resize(bins_.begins.back());
  std::vector<std::uint32_t> next(bins_.begins.begin(), bins_.begins.end() - 1);
  for_each_bin([&](std::size_t bin, std::uint32_t i) { bins_.points[next[bin]++] = i; });
}

// Place beside a segment, beyond whose ends the nearest end counts.
LinePlace LineField::beside(std::size_t segment, glm::dvec2 p) const noexcept {
  const double spacing_m = line_.spacing_m;
  const Hermite curve{line_.points_m[segment], spacing_m * line_.tangents[segment],
                      line_.points_m[segment + 1], spacing_m * line_.tangents[segment + 1]};
  // The component along the tangent changes its sign at the nearest point, almost linearly.
  const double before = glm::dot(p - curve.p, curve.v), after = glm::dot(p - curve.q, curve.w);
  double t = before <= 0 ? 0 : after >= 0 ? 1 : before / (before - after);
  if (0 < t && t < 1) {  // one step of Newton's method, except near the centre of a bend
    const glm::dvec2 off_m = p - curve.at(t), velocity = curve.velocity(t);
    const double square = glm::dot(velocity, velocity);
    const double slope = std::max(square - glm::dot(off_m, curve.acceleration(t)), square / 4);
    t = std::clamp(t + glm::dot(off_m, velocity) / slope, 0.0, 1.0);
  }
  // Beyond the centre of a bend, an end of the segment can be nearer than the foot of the normal.
  if (glm::distance(p, curve.at(t)) > glm::distance(p, curve.p)) t = 0;
  if (glm::distance(p, curve.at(t)) > glm::distance(p, curve.q)) t = 1;
  const glm::dvec2 off_m = p - curve.at(t);
  return {spacing_m * (static_cast<double>(segment) + t),
          std::copysign(glm::length(off_m), cross(curve.velocity(t), off_m))};
}

std::optional<LinePlace> LineField::place(glm::dvec2 p) const noexcept {
  const glm::dvec2 at = (p - bins_.corner_m) / bins_.size_m;
  if (!(at.x >= 0 && at.y >= 0 && at.x < bins_.count.x && at.y < bins_.count.y))
    return std::nullopt;
  const std::size_t bin = static_cast<std::size_t>(at.y) * static_cast<std::size_t>(bins_.count.x) +
                          static_cast<std::size_t>(at.x);
  const std::vector<glm::dvec2>& points = line_.points_m;
  std::size_t nearest = points.size();
  double least_m2 = std::numeric_limits<double>::infinity();
  const auto end = bins_.points.begin() + bins_.begins[bin + 1];
  for (auto it = bins_.points.begin() + bins_.begins[bin]; it != end;) {
    const glm::dvec2 off_m = p - points[*it];
    const double square_m2 = glm::dot(off_m, off_m);
    if (square_m2 < least_m2) {
      least_m2 = square_m2;
      nearest = *it++;
      continue;
    }
    // Distances change by at most the spacing from one point to the next; the last of those that
    // are skipped is still farther away.
    const double skipped = (std::sqrt(square_m2) - std::sqrt(least_m2)) / line_.spacing_m * 0.999;
    it = std::lower_bound(it + 1, end, *it + std::max(1u, static_cast<std::uint32_t>(skipped)));
  }
  if (nearest == points.size()) return std::nullopt;
  std::optional<LinePlace> found;
  if (nearest > 0) found = beside(nearest - 1, p);
  if (nearest + 1 < points.size()) {
    const LinePlace next = beside(nearest, p);
    if (!found || std::abs(next.across_m) < std::abs(found->across_m)) found = next;
  }
  if (std::abs(found->across_m) > reach_m_) return std::nullopt;
  return found;
}

}  // namespace groundray
