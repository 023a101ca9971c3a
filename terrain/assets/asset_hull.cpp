#include "terrain/assets/asset_hull.h"

#include <algorithm>
#include <cstddef>
#include <tuple>

namespace groundray {
namespace {

double cross(const glm::dvec2& o, const glm::dvec2& a, const glm::dvec2& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

}  // namespace

// Andrew's monotone chain (1979).
double hull_area(std::vector<glm::dvec2> points) {
  if (points.size() < 3) return 0;
  std::ranges::sort(points, {}, [](const glm::dvec2& p) { return std::tuple(p.x, p.y); });
  std::vector<glm::dvec2> hull;
  const auto add = [&](const glm::dvec2& p, std::size_t kept) {
    while (hull.size() >= kept + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const glm::dvec2& p : points) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  double twice = 0;
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) twice += cross(hull[0], hull[i], hull[i + 1]);
  return twice / 2;
}

}  // namespace groundray
