#include "apps/view/window/orbit.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/math.h"

namespace groundray {
namespace {

constexpr double steepest_rad = std::numbers::pi / 2 - 1e-3;
constexpr glm::dvec3 up_w{0, 0, 1};

// Direction as azimuth, from east towards north, and elevation.
struct Heading {
  double yaw_rad, pitch_rad;
};

Heading heading_of(const glm::dvec3& direction) {
  return {math::atan2(direction.y, direction.x),
          math::atan2(direction.z, math::hypot(direction.x, direction.y))};
}

glm::dvec3 direction_of(const Heading& heading) {
  const double pitch_rad = std::clamp(heading.pitch_rad, -steepest_rad, steepest_rad);
  return {math::cos(pitch_rad) * math::cos(heading.yaw_rad),
          math::cos(pitch_rad) * math::sin(heading.yaw_rad), math::sin(pitch_rad)};
}

// For a vertical line of sight, the up vector defines the yaw.
Heading sight_of(const Look& look) {
  const glm::dvec3 ahead = look.at_w_m - look.from_w_m;
  Heading heading = heading_of(ahead);
  if (math::hypot(ahead.x, ahead.y) <= 1e-9 * glm::length(ahead)) {
    heading.yaw_rad = math::atan2(look.up.y, look.up.x);
  }
  return heading;
}

glm::dvec3 right_of(const Look& look) {
  const double yaw_rad = sight_of(look).yaw_rad;
  return {math::sin(yaw_rad), -math::cos(yaw_rad), 0};
}

}  // namespace

Look orbited(const Look& look, double yaw_rad, double pitch_rad) {
  const Heading sight = sight_of(look);
  const double distance_m = glm::distance(look.from_w_m, look.at_w_m);
  const glm::dvec3 ahead = direction_of({sight.yaw_rad + yaw_rad, sight.pitch_rad - pitch_rad});
  return {look.at_w_m - distance_m * ahead, look.at_w_m, up_w};
}

Look panned(const Look& look, double right_m, double up_m) {
  const glm::dvec3 right = right_of(look);
  const glm::dvec3 upward = glm::cross(right, direction_of(sight_of(look)));
  const glm::dvec3 shift_m = right_m * right + up_m * upward;
  return {look.from_w_m + shift_m, look.at_w_m + shift_m, look.up};
}

Look zoomed(const Look& look, double factor, const glm::dvec3& towards_w_m) {
  return {towards_w_m + factor * (look.from_w_m - towards_w_m),
          towards_w_m + factor * (look.at_w_m - towards_w_m), look.up};
}

Look flown(const Look& look, const glm::dvec3& ahead_right_up_m) {
  const glm::dvec3 shift_m = ahead_right_up_m.x * direction_of(sight_of(look)) +
                             ahead_right_up_m.y * right_of(look) + ahead_right_up_m.z * up_w;
  return {look.from_w_m + shift_m, look.at_w_m + shift_m, up_w};
}

double metres_per_pixel(const Look& look, double view_angle_rad, double height_px) {
  return 2 * glm::distance(look.from_w_m, look.at_w_m) * math::tan(view_angle_rad / 2) /
         std::max(1.0, height_px);
}

}  // namespace groundray
