#include "terrain/scatter/clearing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/error.h"

namespace groundray {
namespace {

bool is_finite_point(glm::dvec2 p) { return std::isfinite(p.x) && std::isfinite(p.y); }

void check_clearings(std::span<const Clearing> clearings) {
  Violations broken("clearings");
  for (std::size_t i = 0; i < clearings.size(); ++i) {
    const auto& [points, half_width_m, shape] = clearings[i];
    const std::size_t least = shape == Clearing::Shape::Polygon ? 3 : 1;
    broken.unless(points.size() >= least, "clearing {} has {} points; it needs {} or more", i,
                  points.size(), least);
    broken.unless(std::ranges::all_of(points, is_finite_point),
                  "clearing {} has a point that is not finite", i);
    broken.unless(half_width_m >= 0 && std::isfinite(half_width_m),
                  "clearing {} has half_width_m = {}; it must be 0 or more", i, half_width_m);
  }
  broken.throw_if_any();
}

double squared(glm::dvec2 v) { return glm::dot(v, v); }

double squared_distance(glm::dvec2 p, glm::dvec2 from, glm::dvec2 to) {
  const glm::dvec2 along = to - from;
  const double length2 = squared(along);
  const double t = length2 > 0 ? std::clamp(glm::dot(p - from, along) / length2, 0.0, 1.0) : 0;
  return squared(p - (from + t * along));
}

// Returns whether a ray from p along x crosses the outline an odd number of times.
bool is_inside(glm::dvec2 p, const std::vector<glm::dvec2>& polygon) {
  bool inside = false;
  glm::dvec2 from = polygon.back();
  for (const glm::dvec2 to : polygon) {
    if ((from.y > p.y) != (to.y > p.y) &&
        p.x < from.x + (p.y - from.y) / (to.y - from.y) * (to.x - from.x)) {
      inside = !inside;
    }
    from = to;
  }
  return inside;
}

// Returns whether the bounding box of two corners, widened by a margin, overlaps the area.
bool meets(const Area& area, glm::dvec2 a, glm::dvec2 b, double margin_m) {
  const glm::dvec2 low = glm::min(a, b) - margin_m;
  const glm::dvec2 high = glm::max(a, b) + margin_m;
  return low.x <= area.high_m.x && high.x >= area.low_m.x && low.y <= area.high_m.y &&
         high.y >= area.low_m.y;
}

}  // namespace

ClearedGround::ClearedGround(std::span<const Clearing> clearings) {
  check_clearings(clearings);
  for (const auto& [points, half_width_m, shape] : clearings) {
    const bool is_polygon = shape == Clearing::Shape::Polygon;
    if (points.size() == 1) strips_.push_back({points[0], points[0], half_width_m});
    for (std::size_t i = 1; i < points.size(); ++i) {
      strips_.push_back({points[i - 1], points[i], half_width_m});
    }
    if (!is_polygon) continue;
    strips_.push_back({points.back(), points.front(), half_width_m});
    polygons_.push_back(points);
  }
}

bool ClearedGround::contains(glm::dvec2 p) const noexcept {
  return std::ranges::any_of(strips_,
                             [&](const Strip& strip) {
                               return squared_distance(p, strip.from, strip.to) <=
                                      strip.half_width_m * strip.half_width_m;
                             }) ||
         std::ranges::any_of(polygons_, [&](const auto& polygon) { return is_inside(p, polygon); });
}

ClearedGround ClearedGround::near(const Area& area) const {
  ClearedGround part;
  std::ranges::copy_if(strips_, std::back_inserter(part.strips_), [&](const Strip& strip) {
    return meets(area, strip.from, strip.to, strip.half_width_m);
  });
  std::ranges::copy_if(polygons_, std::back_inserter(part.polygons_), [&](const auto& polygon) {
    glm::dvec2 low = polygon[0];
    glm::dvec2 high = polygon[0];
    for (const glm::dvec2 p : polygon) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    return meets(area, low, high, 0);
  });
  return part;
}

}  // namespace groundray
