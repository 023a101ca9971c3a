#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec3.hpp>
#include <map>
#include <utility>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"
#include "terrain/assets/figure.h"
#include "terrain/assets/figure_rig.h"
#include "terrain/assets/plan_path.h"

namespace groundray {

/// Walk of a figure along a path: feet that roll over fixed footprints, swings that follow the
/// usual motion of the leg, and hips at the height at which the standing legs have their usual
/// posture. The legs are closed by inverse kinematics.
class FigureWalker {
 public:
  /// @throws Error if the path is too fast for a walk.
  FigureWalker(const GroundHeight& ground, const WalkSpec& spec, FigureRig rig,
               const Trajectory& X_DO);

  /// Returns the poses of all parts in D.
  /// @throws Error if a foot would be outside the DEM or in a hole.
  std::vector<Pose> pose_at(std::chrono::nanoseconds time);

 private:
  // Step of a leg: its number and the phase since the foot landed.
  struct Step {
    long number;
    double phase;
  };
  // Frame of a footprint: origin below the ankle of the flat foot, x along the ground.
  struct Footprint {
    glm::dvec3 origin{0};
    double yaw_rad = 0, up_rad = 0;
  };
  // A foot: its ankle, its yaw and pitch, and the pitch of its toes.
  struct FootPose {
    glm::dvec3 ankle{0};
    double yaw_rad = 0, up_rad = 0;
    double toe_up_rad = 0;

    Pose pose() const { return {turn(yaw_rad, up_rad), ankle}; }
  };

  std::vector<Pose> standing() const;
  double motion(std::chrono::nanoseconds time) const;
  StrideCount count_strides(double speed_m_s) const;
  double amplitude(double s_m) const { return strides_.stride_m(s_m) / rig_.usual_stride; }
  Step step_of(std::size_t leg, double s_m) const;
  double distance_m(std::size_t leg, long number, double phase) const;
  double ground_m(const glm::dvec2& p) const;
  Footprint print_at(const LegRig& leg, const glm::dvec2& p, double yaw_rad) const;
  const Footprint& footprint(std::size_t number_of_leg, long step);
  FootPose standing_foot(std::size_t number_of_leg, long step, double phase);
  FootPose swinging_foot(std::size_t number_of_leg, long step, double phase, double s_m);
  FootPose lowered(std::size_t number_of_leg, double s_m, const FootPose& foot, double motion);
  double root_limit_m(const LegRig& leg, const FootPose& foot, const Pose& root) const;
  FootPose foot_at(std::size_t number_of_leg, double s_m);
  glm::dvec3 usual_ankle(const LegRig& leg, double phase, double size) const;
  double fold_rad(const LegRig& leg, double phase, double size) const;
  PlanPath::Point root_in_plan(double s_m) const;
  double reach_m(std::size_t number_of_leg, double s_m, const PlanPath::Point& root, double up_rad);
  double hip_height_m(std::size_t first, double s_m, const PlanPath::Point& root, double up_rad);
  Pose root_at(double s_m);
  glm::dvec3 from_hip(const LegRig& leg, const glm::dvec3& ankle, double s_m);

  const GroundHeight& ground_;
  const WalkSpec& spec_;
  FigureRig rig_;
  PlanPath path_;
  std::chrono::nanoseconds begin_time_, end_time_;
  StrideCount strides_;
  std::map<std::pair<std::size_t, long>, Footprint> footprints_;
  std::map<double, Pose> roots_;  // by distance
};

}  // namespace groundray
