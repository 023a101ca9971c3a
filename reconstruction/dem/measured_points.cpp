#include "reconstruction/dem/measured_points.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace groundray {

PointErrors point_errors(const glm::dmat3& covariance_m2) noexcept {
  const glm::dmat3& c = covariance_m2;
  const double variance_m2 = c[2][2];
  const glm::dvec2 shared_m2(c[2][0], c[2][1]);
  glm::dvec2 lean(0);
  if (variance_m2 > 0) {
    lean = shared_m2 / variance_m2;
    constexpr double most = MeasuredPoints::most_lean;
    if (const double length = glm::length(lean); length > most) lean *= most / length;
  }
  const double rest_m2 =
      (c[0][0] + c[1][1]) / 2 - glm::dot(lean, shared_m2) + glm::dot(lean, lean) * variance_m2 / 2;
  return {static_cast<float>(std::sqrt(std::max(0.0, variance_m2))), lean,
          static_cast<float>(std::sqrt(std::max(0.0, rest_m2)))};
}

}  // namespace groundray
