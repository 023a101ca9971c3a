#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/geometry/trajectory.h"
#include "core/model/model.h"
#include "core/tracing/ray.h"
#include "terrain/assets/figure.h"
#include "terrain/ground.h"
#include "terrain/ground_path.h"

// Ground on which figures walk, and what is measured of them.
namespace groundray::walking {

inline HeightGrid ground_of(auto height_m) {
  std::vector<float> heights;
  for (int row = 0; row < 201; ++row) {
    for (int column = 0; column < 201; ++column)
      heights.push_back(static_cast<float>(height_m(column / 4.0 - 25, 25 - row / 4.0)));
  }
  return HeightGrid({201, 201}, {-25, 25}, {0.25, -0.25}, heights);
}
inline HeightGrid flat() {
  return ground_of([](double, double) { return 0; });
}
inline HeightGrid slope(double rise = 0.125) {
  return ground_of([=](double x, double) { return x * rise; });
}
inline HeightGrid bumps() {
  return ground_of([](double x, double y) { return 0.15 * std::sin(x) * std::cos(y / 2); });
}

/// Path along x through (-20, 1), from the time 0.
inline Trajectory straight(const HeightGrid& ground, double m_s) {
  using namespace std::chrono_literals;
  return build_ground_path(ground,
                           {.waypoints_m = {{-20, 1}, {20, 1}}, .speed_m_s = m_s, .duration = 5s});
}

inline std::vector<Trajectory> walk_on(
    const HeightGrid& ground, const AssetSpec& asset, const Trajectory& path,
    std::chrono::nanoseconds spacing = std::chrono::milliseconds(5)) {
  const Ground surface(ground);
  return walk([&](const glm::dvec2& p) { return surface.height_m_at(p); },
              {.asset = asset, .spacing = spacing}, path);
}

/// A point that is fixed in a part: its position and speed.
struct PartPoint {
  glm::dvec3 p;
  double m_s;
};
inline PartPoint part_point(const Trajectory& part, const glm::dvec3& p_P,
                            std::chrono::nanoseconds time) {
  const Pose pose = part.pose_at(time);
  const Velocity v = part.velocity_at(time);
  return {pose * p_P, glm::length(v.linear_m_s + glm::cross(v.angular_rad_s, pose.rotation * p_P))};
}

/// Range at which a ray hits a model, by all of its triangles (Moeller and Trumbore, 1997).
inline double hit_by_hand_m(const Model& model, const Pose& X_DP, const Ray& ray) {
  const Pose X_PD = inverse(X_DP);
  const glm::dvec3 o = X_PD * ray.origin, d = X_PD.rotation * ray.direction;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const glm::uvec3& t : model.mesh.triangles) {
    const auto& v = model.mesh.vertices_m;
    const glm::dvec3 e = v[t.y] - v[t.x], f = v[t.z] - v[t.x], h = glm::cross(d, f);
    const double det = glm::dot(e, h);
    if (std::abs(det) < 1e-15) continue;
    const glm::dvec3 s = o - v[t.x], q = glm::cross(s, e);
    const double a = glm::dot(s, h) / det, b = glm::dot(d, q) / det, r = glm::dot(f, q) / det;
    if (a >= 0 && b >= 0 && a + b <= 1 && r > 0) nearest_m = std::min(nearest_m, r);
  }
  return nearest_m;
}

}  // namespace groundray::walking
