#pragma once

#include <array>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/pose.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {

/// Angle over a stride, degrees: a mean, then cosine and sine of each harmonic.
struct AngleSeries {
  double mean = 0;
  std::array<double, 10> harmonics{};

  /// Returns the angle in radians.
  /// @param amplitude  factor of the harmonics.
  double at(double phase, double amplitude) const;
};

/// A leg of two bones and a foot, or of three segments and a foot. The third segment is one bone or
/// two, and turns as the upper bone does: metatarsus and femur, or forearm and scapula. Lengths are
/// in metres, or in units of the figure's size.
struct LegRig {
  std::array<int, 4> parts{};              ///< upper bone, lower bone, foot, toes (-1 for none)
  std::array<int, 2> third_parts{-1, -1};  ///< bones of the third segment (-1 for none)
  glm::dvec3 hip{0};                       ///< in the root's frame
  double upper = 0, lower = 0;
  std::array<double, 2> third{};       ///< lengths of the bones of the third segment
  double third_back_rad = 0;           ///< pitch of the third segment behind the upper bone
  double fold_rad = 0;                 ///< largest flexion between its bones, in the swing
  double ankle = 0;                    ///< height of the ankle above the sole
  double heel = 0, ball = 0, tip = 0;  ///< contacts of the sole, forward of the ankle
  double track = 0;                    ///< lateral position of the footprints; left is positive
  double stand_x = 0, stand_y = 0;     ///< of the ankle, from the hip, while standing
  double splay_deg = 0;                ///< yaw of the foot outwards while standing
  double phase = 0;  ///< of the stride at which the foot lands, relative to the first leg's
  AngleSeries thigh, knee,
      foot;  ///< upper bone forward of the vertical, flexion, pitch of the foot

  bool has_third_segment() const { return third_parts[0] >= 0; }
  /// Returns the largest distance of the ankle from the hip, with the third segment folded.
  double reach(double folded_rad = 0) const;
};

/// A part that swings on a parent part.
struct JointRig {
  int part = 0, parent = 0;
  glm::dvec3 at{0};      ///< position in the parent's frame
  double roll_deg = 0;   ///< about x, constant
  double pitch_deg = 0;  ///< forward swing of what hangs down: mean
  double stand_deg = 0;  ///< added to it while the figure stands
  double swing_deg = 0;  ///< its amplitude
  double yaw_deg = 0;    ///< amplitude of the turn to the left, once a stride
  double harmonic = 1, phase = 0;
};

/// Rolling of a foot over the ground, as fractions of a stride and angles. Between `flat` and
/// `rise` the sole is on the ground.
struct FootRoll {
  double duty = 0.62;  ///< fraction of the stride during which the foot bears weight
  double flat = 0.12, rise = 0.31;
  double heel_rad = 0, push_rad = 0;  ///< pitch of the foot when it lands and when it leaves
  double toe_rad = 0;                 ///< pitch of the foot beyond which the toes leave the ground
  double centre = 0.24;  ///< phase at which the hip passes over the standing foot's ankle
  double lift = 0;       ///< added height of the swinging foot
};

/// Skeleton of an asset that walks, and its gait. Part 0 is the root.
struct FigureRig {
  std::size_t parts = 0;
  std::vector<LegRig> legs;  ///< pairs of left and right
  std::vector<JointRig> joints;
  FootRoll roll;
  double stand_height = 0;  ///< of the root above the ground
  double sway = 0;          ///< amplitude of the root to the side that bears weight
  double root_yaw_deg = 0;  ///< amplitude of the turn that brings the swinging leg forward
  double usual_stride = 0;  ///< stride of the angle series
  double stride_s = 0, stride_power = 0;  ///< stride = stride_s * speed^stride_power
  double most_speed = 0;
};

/// Returns a rig with all lengths multiplied; speeds follow the square root (equal Froude number).
FigureRig scaled(FigureRig rig, double size_m);

/// Returns the poses of all parts while the figure stands on the plane z = 0, in its frame O.
std::vector<Pose> standing_pose(const FigureRig& rig);

/// Sets the poses of a leg's bones by inverse kinematics.
/// @param foot  pose of the foot; if it is out of reach, the last bone ends before it.
/// @param fold_rad  flexion between the bones of the third segment.
void pose_leg(const LegRig& leg, const Pose& root, const Pose& foot, double fold_rad,
              std::vector<Pose>& parts);

/// Sets the poses of all joints.
/// @param amplitude  factor of the swings; 0 while standing.
void pose_joints(const FigureRig& rig, double phase, double amplitude, std::vector<Pose>& parts);

/// Returns a rotation by yaw to the left, then pitch with the nose up.
glm::dquat turn(double yaw_rad, double up_rad);

/// Rises smoothly from 0 to 1 while x does.
double smooth_step(double x);

// Rigs, of unit size, and parts of unit size.
FigureRig person_rig(const AssetShape& shape);
FigureRig deer_rig(const AssetShape& shape);
Model make_person_part(const AssetShape& shape, std::size_t part);
Model make_deer_part(const AssetShape& shape, std::size_t part);

}  // namespace groundray
