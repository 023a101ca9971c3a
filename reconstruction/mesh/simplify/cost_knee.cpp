#include "reconstruction/mesh/simplify/cost_knee.h"

#include <algorithm>
#include <cmath>

namespace groundray {
namespace {

struct Place {
  double x = 0, y = 0;
};

Place place_of(const CostStep& step) {
  return {std::log(static_cast<double>(std::max<std::size_t>(step.triangles, 1))),
          std::log(step.cost)};
}

}  // namespace

std::size_t find_knee(const std::vector<CostStep>& steps) {
  const std::size_t all = steps.front().triangles;
  double so_far = 0;
  std::size_t knee = all;  // the last without cost, if there is no curve
  std::vector<Place> curve;
  std::vector<std::size_t> triangles;
  for (const CostStep& step : steps) {
    so_far = std::max(so_far, step.cost);
    if (!(so_far > 0)) knee = step.triangles;
    if (!(so_far > 0) || 2 * step.triangles > all || 1000 * step.triangles < all) continue;
    curve.push_back(place_of({so_far, step.triangles}));
    triangles.push_back(step.triangles);
  }
  if (curve.size() < 3) return knee;
  const Place first = curve.front();
  const double width = curve.back().x - first.x, height = curve.back().y - first.y;
  double farthest = -1;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double away = std::abs(first.y + height * (curve[i].x - first.x) / width - curve[i].y);
    if (away <= farthest) continue;
    farthest = away;
    knee = triangles[i];
  }
  return knee;
}

}  // namespace groundray
