#include "sensors/camera/lens/stereo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {
namespace {

constexpr double most_turn_deg = 60;
constexpr double most_slant_deg = 45;
constexpr double most_field_deg = 85;

double angle_deg(const glm::dvec3& a, const glm::dvec3& b) {
  return glm::degrees(math::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));
}

double turn_deg(const glm::dquat& a, const glm::dquat& b) {
  const glm::dquat turn = glm::conjugate(a) * b;
  const double sine = glm::length(glm::dvec3(turn.x, turn.y, turn.z));
  return glm::degrees(2 * math::atan2(sine, std::abs(turn.w)));
}

// Returns the smallest rotation that takes the x axis to a unit vector other than -x.
glm::dquat from_x_to(const glm::dvec3& v) {
  return glm::normalize(glm::dquat(1 + v.x, 0, -v.z, v.y));
}

// Returns the viewing direction at the middle of a side of the image, or at the imaged position
// nearest to it on the way to the image's middle; nullopt if there is none.
std::optional<glm::dvec3> look_towards(const Lens& lens, const glm::dvec2& side) {
  const glm::dvec2 middle = (glm::dvec2(lens.size_px()) - 1.0) / 2.0;
  constexpr int steps = 64;
  for (int step = steps; step > 0; --step) {
    if (const auto ray = lens.ray(middle * (1.0 + side * (1.0 * step / steps))))
      return ray->direction;
  }
  return std::nullopt;
}

struct Side {
  const char* name;
  glm::dvec2 towards;
};
constexpr std::array<Side, 4> sides{
    {{"left", {-1, 0}}, {"right", {1, 0}}, {"upper", {0, -1}}, {"lower", {0, 1}}}};

// Returns the mean position, on the plane z = 1 of a frame R, of the viewing directions at the
// middles of an image's sides.
glm::dvec2 mean_on_plane(const char* camera, const Lens& lens, const glm::dquat& R_RC,
                         Violations& broken) {
  glm::dvec2 sum(0);
  for (const Side& side : sides) {
    const auto direction = look_towards(lens, side.towards);
    broken.unless(direction.has_value(),
                  "the {} camera has no rays between the middle and the {} side of its image: is "
                  "its centre_px correct?",
                  camera, side.name);
    if (!direction) continue;
    const glm::dvec3 turned = R_RC * *direction;
    const double field_deg = angle_deg({0, 0, 1}, turned);
    broken.unless(field_deg <= most_field_deg,
                  "the {} camera sees {:.1f} deg from the pair's common axis at the {} side of its "
                  "image: a pinhole's image must stay within {}: render it as_mounted",
                  camera, field_deg, side.name, most_field_deg);
    sum += glm::dvec2(turned) / turned.z;
  }
  return sum / static_cast<double>(sides.size());
}

}  // namespace

RectifiedPair rectified(const StereoCamera& left, const StereoCamera& right) {
  const Lens left_lens(left.lens, left.size_px), right_lens(right.lens, right.size_px);
  Violations broken("stereo pair to rectify");
  broken.unless(left.size_px == right.size_px,
                "the left image is {} x {} px, the right one {} x {}: they must be equal",
                left.size_px.x, left.size_px.y, right.size_px.x, right.size_px.y);
  const double turned_deg = turn_deg(left.X_BC.rotation, right.X_BC.rotation);
  broken.unless(turned_deg <= most_turn_deg,
                "the relative rotation of the cameras is {:.1f} deg, but must be at most {}",
                turned_deg, most_turn_deg);
  const glm::dquat R_BM = half_way_between(left.X_BC.rotation, right.X_BC.rotation);
  const glm::dvec3 p_LR =
      glm::conjugate(R_BM) * (right.X_BC.translation_m - left.X_BC.translation_m);
  const double baseline_m = glm::length(p_LR);
  broken.unless(baseline_m > 0 && angle_deg({1, 0, 0}, p_LR) <= most_slant_deg,
                "the right camera is ({:.4g}, {:.4g}, {:.4g}) m (right, down, ahead) of the left "
                "one, but must be to its right within {} deg: are they swapped, or is one above or "
                "ahead of the other?",
                p_LR.x, p_LR.y, p_LR.z, most_slant_deg);
  broken.throw_if_any();

  const glm::dquat R_BR = glm::normalize(R_BM * from_x_to(p_LR / baseline_m));
  const auto from = [&](const StereoCamera& camera) {
    return glm::normalize(glm::conjugate(R_BR) * camera.X_BC.rotation);
  };
  const glm::dvec2 mean = (mean_on_plane("left", left_lens, from(left), broken) +
                           mean_on_plane("right", right_lens, from(right), broken)) /
                          2.0;
  broken.throw_if_any();
  const double f_px = (left_lens.focal_px().value() + right_lens.focal_px().value()) / 2;
  const glm::dvec2 middle = (glm::dvec2(left.size_px) - 1.0) / 2.0;
  return {{{f_px, f_px}, middle - f_px * mean, 0},
          left.size_px,
          {R_BR, left.X_BC.translation_m},
          {R_BR, right.X_BC.translation_m},
          baseline_m,
          from(left),
          from(right)};
}

}  // namespace groundray
