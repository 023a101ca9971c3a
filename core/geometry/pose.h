#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

namespace groundray {

/// Rigid transformation X_AB: the pose of frame B in frame A. X_AC = X_AB * X_BC.
struct Pose {
  glm::dquat rotation{1, 0, 0, 0};    ///< R_AB, a unit quaternion (w, x, y, z).
  glm::dvec3 translation_m{0, 0, 0};  ///< p_AB: from A's origin to B's, in A.

  friend bool operator==(const Pose&, const Pose&) = default;
};

/// Returns X_AC = X_AB * X_BC.
Pose operator*(const Pose& X_AB, const Pose& X_BC);

/// Returns p_AQ = X_AB * p_BQ, metres.
glm::dvec3 operator*(const Pose& X_AB, const glm::dvec3& p_BQ);

/// Returns X_BA.
Pose inverse(const Pose& X_AB);

/// Returns the rotation that turns by `yaw_rad` about z, then `pitch_rad` about the new y, then
/// `roll_rad` about the new x (x forward, y left, z up: positive pitch lowers the nose, positive
/// roll lowers the right side).
glm::dquat rotation_from_yaw_pitch_roll(double yaw_rad, double pitch_rad, double roll_rad);

/// Returns the rotation half-way between two, along the shorter way.
glm::dquat half_way_between(const glm::dquat& one, const glm::dquat& other);

/// Velocity of a frame B in a frame A.
struct Velocity {
  glm::dvec3 linear_m_s{0};     ///< of B's origin, in axes of A
  glm::dvec3 angular_rad_s{0};  ///< in axes of A
};

/// Motion at constant body velocity: B starts at the identity and has the pose `at(s)` after the
/// fraction s of the motion. Stores the exponential map of one twist in a form that needs one sine
/// and one cosine per evaluation.
/// @see Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation (1994),
///      section 2.3.
class Screw {
 public:
  /// Constructs the motion with at(0) = identity and at(1) = `end`, which turns by at most pi.
  explicit Screw(const Pose& end);

  /// Returns the pose after the fraction `s` of the motion; s may lie outside [0, 1].
  Pose at(double s) const;
  /// Returns the rate of change of the pose at `s`, with s as the time.
  Velocity velocity_at(double s) const;

 private:
  glm::dvec3 axis_;       // unit, or zero for a pure translation
  double angle_rad_ = 0;  // over s in [0, 1]
  glm::dvec3 along_m_;    // p(s) = along s + sine sin(angle s) + versine (1 - cos(angle s))
  glm::dvec3 sine_m_{0};
  glm::dvec3 versine_m_{0};
};

}  // namespace groundray
