#include "core/geometry/pose.h"

#include <glm/geometric.hpp>

#include "core/math.h"

namespace groundray {

Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  return {X_AB.rotation * X_BC.rotation, X_AB * X_BC.translation_m};
}

glm::dvec3 operator*(const Pose& X_AB, const glm::dvec3& p_BQ) {
  return X_AB.translation_m + X_AB.rotation * p_BQ;
}

Pose inverse(const Pose& X_AB) {
  const glm::dquat back = glm::conjugate(X_AB.rotation);
  return {back, -(back * X_AB.translation_m)};
}

glm::dquat rotation_from_yaw_pitch_roll(double yaw_rad, double pitch_rad, double roll_rad) {
  const auto half_turn = [](double angle_rad) {
    return glm::dvec2(math::cos(0.5 * angle_rad), math::sin(0.5 * angle_rad));
  };
  const glm::dvec2 yaw = half_turn(yaw_rad), pitch = half_turn(pitch_rad),
                   roll = half_turn(roll_rad);
  return glm::dquat(yaw.x, 0, 0, yaw.y) * glm::dquat(pitch.x, 0, pitch.y, 0) *
         glm::dquat(roll.x, roll.y, 0, 0);
}

glm::dquat half_way_between(const glm::dquat& one, const glm::dquat& other) {
  return glm::normalize(glm::dot(one, other) < 0 ? one - other : one + other);
}

Screw::Screw(const Pose& end) : axis_(0), along_m_(end.translation_m) {
  glm::dquat q = end.rotation;
  if (q.w < 0) q = -q;
  const glm::dvec3 vector(q.x, q.y, q.z);
  const double sine = glm::length(vector);
  if (sine == 0) return;
  axis_ = vector / sine;
  angle_rad_ = 2 * math::atan2(sine, q.w);

  // The end point determines the linear part v of the twist: p = V v, where V has an inverse in
  // closed form. With w = angle * axis,
  // p(s) = axis (axis . v) s + (sin/angle) v_perp + ((1 - cos)/angle) axis x v.
  const glm::dvec3& p = end.translation_m;
  const double half = angle_rad_ / 2;
  const glm::dvec3 parallel = axis_ * glm::dot(axis_, p);
  const glm::dvec3 across = p - parallel;
  const glm::dvec3 v = across * (half / math::tan(half)) - glm::cross(axis_, across) * half;
  along_m_ = parallel;
  sine_m_ = v / angle_rad_;
  versine_m_ = glm::cross(axis_, v) / angle_rad_;
}

Pose Screw::at(double s) const {
  if (angle_rad_ == 0) return {{1, 0, 0, 0}, along_m_ * s};
  const double half = angle_rad_ * s / 2;
  const double sine = math::sin(half);
  const double cosine = math::cos(half);
  const glm::dvec3 translation =
      along_m_ * s + sine_m_ * (2 * sine * cosine) + versine_m_ * (2 * sine * sine);
  return {glm::dquat(cosine, axis_ * sine), translation};
}

Velocity Screw::velocity_at(double s) const {
  const double angle = angle_rad_ * s;
  return {along_m_ + angle_rad_ * (sine_m_ * math::cos(angle) + versine_m_ * math::sin(angle)),
          axis_ * angle_rad_};
}

}  // namespace groundray
