#include "terrain/assets/figure_rig.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numbers>

#include "core/math.h"

namespace groundray {
namespace {

constexpr double degree = std::numbers::pi / 180;

// Pose of a bone that hangs from a joint: z points from its end to its beginning, x forward.
Pose bone(const glm::dvec3& begin, const glm::dvec3& end, const glm::dvec3& forward) {
  const glm::dvec3 z = glm::normalize(begin - end);
  const glm::dvec3 y = glm::normalize(glm::cross(z, forward));
  return {glm::quat_cast(glm::dmat3(glm::cross(y, z), y, z)), begin};
}

// Vector of the sagittal plane, x forward and y down, at an angle forward of the vertical.
glm::dvec2 hanging(double length, double forward_rad) {
  return length * glm::dvec2(math::sin(forward_rad), math::cos(forward_rad));
}

// Upper bone and third segment, joined, if the upper bone hangs vertically.
glm::dvec2 joined(const LegRig& leg, double fold_rad) {
  return glm::dvec2(0, leg.upper) + hanging(leg.third[0], -leg.third_back_rad) +
         hanging(leg.third[1], -leg.third_back_rad - fold_rad);
}

glm::dquat about(const glm::dvec3& axis, double angle_rad) {
  return {math::cos(angle_rad / 2), axis * math::sin(angle_rad / 2)};
}

}  // namespace

double AngleSeries::at(double phase, double amplitude) const {
  double sum = 0;
  for (std::size_t k = 0; k < harmonics.size() / 2; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k + 1) * phase;
    sum += harmonics[2 * k] * math::cos(angle) + harmonics[2 * k + 1] * math::sin(angle);
  }
  return (mean + amplitude * sum) * degree;
}

FigureRig scaled(FigureRig rig, double size_m) {
  for (LegRig& leg : rig.legs) {
    leg.hip *= size_m;
    for (double* length :
         {&leg.upper, &leg.lower, &leg.third[0], &leg.third[1], &leg.ankle, &leg.heel, &leg.ball,
          &leg.tip, &leg.track, &leg.stand_x, &leg.stand_y}) {
      *length *= size_m;
    }
  }
  for (JointRig& joint : rig.joints) joint.at *= size_m;
  for (double* length : {&rig.roll.lift, &rig.stand_height, &rig.sway, &rig.usual_stride})
    *length *= size_m;
  const double root = std::sqrt(size_m);
  rig.most_speed *= root;
  rig.stride_s *= size_m / math::pow(root, rig.stride_power);
  return rig;
}

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

glm::dquat turn(double yaw_rad, double up_rad) {
  return about({0, 0, 1}, yaw_rad) * about({0, 1, 0}, -up_rad);
}

double LegRig::reach(double folded_rad) const {
  return glm::length(joined(*this, folded_rad)) + lower;
}

// Because the third segment turns with the upper bone, both act as one bone, and the leg is closed
// as one of two bones.
void pose_leg(const LegRig& leg, const Pose& root, const Pose& foot, double fold_rad,
              std::vector<Pose>& parts) {
  const glm::dvec3 hip = root * leg.hip;
  const glm::dvec3 to_ankle = foot.translation_m - hip;
  const glm::dvec2 both = joined(leg, fold_rad);
  const double square = glm::dot(both, both);
  const double most = (std::sqrt(square) + leg.lower) * (1 - 1e-6);
  const double reach = std::min(glm::length(to_ankle), most);
  const glm::dvec3 down = glm::normalize(to_ankle);
  const glm::dvec3 ahead = root.rotation * glm::dvec3(1, 0, 0);
  const glm::dvec3 forward = glm::normalize(ahead - down * glm::dot(ahead, down));
  const double along = (square + reach * reach - leg.lower * leg.lower) / (2 * reach);
  const double aside = std::sqrt(std::max(square - along * along, 0.0));
  const double upper_rad = math::atan2(aside, along) - math::atan2(both.x, both.y);
  glm::dvec3 joint = hip;
  const auto add = [&](int part, const glm::dvec2& bone_vector) {
    const glm::dvec3 end = joint + forward * bone_vector.x + down * bone_vector.y;
    parts[static_cast<std::size_t>(part)] = bone(joint, end, forward);
    joint = end;
  };
  add(leg.parts[0], hanging(leg.upper, upper_rad));
  add(leg.parts[1], {-aside, reach - along});
  double angle_rad = upper_rad - leg.third_back_rad;
  for (std::size_t i = 0; i < 2 && leg.third_parts[i] >= 0; ++i) {
    add(leg.third_parts[i], hanging(leg.third[i], angle_rad));
    angle_rad -= fold_rad;
  }
  parts[static_cast<std::size_t>(leg.parts[2])] = foot;
}

void pose_joints(const FigureRig& rig, double phase, double amplitude, std::vector<Pose>& parts) {
  for (const JointRig& joint : rig.joints) {
    const double turn_rad = 2 * std::numbers::pi * phase;
    const double swing =
        math::cos(joint.harmonic * turn_rad + 2 * std::numbers::pi * joint.phase) * amplitude;
    const glm::dquat rotation =
        about({0, 0, 1}, amplitude * joint.yaw_deg * degree * math::cos(turn_rad)) *
        about({1, 0, 0}, joint.roll_deg * degree) *
        about({0, 1, 0}, -(joint.pitch_deg + joint.swing_deg * swing) * degree);
    parts[static_cast<std::size_t>(joint.part)] =
        parts[static_cast<std::size_t>(joint.parent)] * Pose{rotation, joint.at};
  }
}

std::vector<Pose> standing_pose(const FigureRig& rig) {
  std::vector<Pose> parts(rig.parts);
  parts[0] = {glm::dquat(1, 0, 0, 0), {0, 0, rig.stand_height}};
  for (const LegRig& leg : rig.legs) {
    const Pose foot{turn(leg.splay_deg * degree, 0),
                    {leg.hip.x + leg.stand_x, leg.hip.y + leg.stand_y, leg.ankle}};
    pose_leg(leg, parts[0], foot, 0, parts);
    if (leg.parts[3] >= 0) {
      parts[static_cast<std::size_t>(leg.parts[3])] =
          foot * Pose{glm::dquat(1, 0, 0, 0), {leg.ball, 0, -leg.ankle}};
    }
  }
  FigureRig still = rig;
  for (JointRig& joint : still.joints) joint.pitch_deg += joint.stand_deg;
  pose_joints(still, 0, 0, parts);
  return parts;
}

}  // namespace groundray
