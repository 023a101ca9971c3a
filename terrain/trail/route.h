#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <string_view>
#include <vector>

namespace groundray {

/// Limits of a route over the ground.
struct RouteLimits {
  double most_grade = 0.47;      ///< largest rise over run
  double most_side_slope = 0.5;  ///< largest slope across the route, rise over run
};

/// Returns waypoints from one point of D to another, such that the sum of lengths, each multiplied
/// by 1 + 4 (grade / most_grade)^2 + (side slope / most_side_slope)^2, is the least among paths
/// over a lattice of about 512 points across, around both. Steeper pieces are left out, and so is
/// what has no ground.
/// @param ground      height at a point of D; nothing where there is no ground.
/// @param origin_w_m  position of D in W, for messages.
/// @throws Error that names the place nearest to `to` which can be reached, if there is no route.
std::vector<glm::dvec2> find_route(const std::function<std::optional<double>(glm::dvec2)>& ground,
                                   glm::dvec2 from, glm::dvec2 to, const RouteLimits& limits,
                                   glm::dvec2 origin_w_m);

}  // namespace groundray
