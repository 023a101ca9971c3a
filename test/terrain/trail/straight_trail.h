#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/trail/trail.h"

// A straight trail across a tilted plane, and its cross-section.
namespace groundray::trail_test {

inline constexpr glm::dvec2 start{-30, -21};
inline constexpr glm::dvec2 along{0.8, 0.6};
inline constexpr glm::dvec2 left{-0.6, 0.8};
inline constexpr double length_m = 70;
inline constexpr double grade = 0.1, cross_slope = 0.05;

// Plane that rises along the trail, and to its left.
inline double plane_m(glm::dvec2 p) {
  return 5 + grade * glm::dot(p - start, along) + cross_slope * glm::dot(p - start, left);
}

inline HeightGrid grid_of(auto height_m, double step_m = 1) {
  const int samples = static_cast<int>(100 / step_m) + 1;
  std::vector<float> heights;
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column)
      heights.push_back(
          static_cast<float>(height_m(glm::dvec2(-50 + step_m * column, 50 - step_m * row))));
  }
  return HeightGrid({samples, samples}, {-50, 50}, {step_m, -step_m}, heights);
}

inline Trail::GroundHeight heights_of(const HeightGrid& dem) {
  return [&dem](glm::dvec2 p) { return dem.height_m_at(p); };
}

inline TrailSpec straight() {
  return {.name = "track",
          .waypoints_m = {start, start + 0.4 * length_m * along, start + length_m * along},
          .bank_slope = 0.5,
          .relief_share = 1};
}

// The cross-section: parts of polynomials of the distance u from the middle, written as in
// docs/reference/trails.md.
inline double bump(double u, double width) {
  return std::abs(u) < width / 2 ? std::pow(1 - std::pow(2 * u / width, 2), 2) : 0;
}

inline TrailSpec with_ruts_and_a_ditch() {
  TrailSpec spec = straight();
  spec.width_m = 4;
  spec.crown_m = 0.12;
  spec.ruts = {.track_m = 1.8, .width_m = 0.4, .depth_m = 0.09, .berm_m = 0.03};
  spec.ditches = {.width_m = 1.2, .depth_m = 0.4, .side = TrailSpec::Ditches::Side::Right};
  return spec;
}

inline double section_m(double s, double u) {
  const double level_m = 5 + grade * s;
  if (std::abs(u) < 2) {
    double z_m = level_m + 0.12 * (1 - u * u / 4);
    for (const double centre : {-0.9, 0.9}) {
      z_m -= 0.09 * bump(u - centre, 0.4);
      for (const double side : {-0.3, 0.3}) z_m += 0.03 * bump(u - centre - side, 0.2);
    }
    return z_m;
  }
  if (-3.2 < u && u < 0) return level_m - 0.4 * bump(u + 2.6, 1.2);
  // The plane is higher on the left, where a bank is cut; on the right, one is raised.
  const double ground_m = level_m + cross_slope * u;
  return u > 0 ? std::min(ground_m, level_m + 0.5 * (u - 2))
               : std::max(ground_m, level_m - 0.5 * (-u - 3.2));
}

}  // namespace groundray::trail_test
