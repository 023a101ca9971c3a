#include "terrain/assets/figure_walker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

using std::numbers::pi;

constexpr double reach_share = 0.9985;  // of a leg's length: legs never straighten fully
constexpr double soft_share = 0.004;    // smoothing of the limit of reach, of the hips' height
constexpr double catch_up = 0.45;       // fraction of the swing in which a foot joins its curve
constexpr double slope_share = 0.45;    // of the foot's velocity at take-off that is kept

// Turns a vector of the sagittal plane, x forward and y up, by a pitch with the nose up.
glm::dvec2 pitched(const glm::dvec2& v, double up_rad) {
  const double c = math::cos(up_rad), s = math::sin(up_rad);
  return {v.x * c - v.y * s, v.x * s + v.y * c};
}

// Rises from 0 to 1 and falls back while u goes from 0 to 1.
double bump(double u) { return 16 * u * u * (1 - u) * (1 - u); }

// Pitch of the toes above the ground while a foot pushes off: 0, then that of the foot's excess.
double toe_pitch(const FootRoll& roll, double up_rad) {
  constexpr double width = 0.25;
  const double beyond = -up_rad - roll.toe_rad;
  if (beyond < -width) return 0;
  return beyond < width ? -(beyond + width) * (beyond + width) / (4 * width) : -beyond;
}

double mean_speed_m_s(const Trajectory& X_DO, const PlanPath& path) {
  const std::chrono::duration<double> duration = X_DO.end_time() - X_DO.begin_time();
  return duration.count() > 0 ? path.length_m() / duration.count() : 0;
}

}  // namespace

FigureWalker::FigureWalker(const GroundHeight& ground, const WalkSpec& spec, FigureRig rig,
                           const Trajectory& X_DO)
    : ground_(ground),
      spec_(spec),
      rig_(std::move(rig)),
      path_(X_DO),
      begin_time_(X_DO.begin_time()),
      end_time_(X_DO.end_time()),
      strides_(count_strides(mean_speed_m_s(X_DO, path_))) {}

// Strides on a path: shorter where the ground is steep.
StrideCount FigureWalker::count_strides(double speed_m_s) const {
  if (speed_m_s > rig_.most_speed) {
    throw Error(
        "a {} of this size walks at up to {:.2f} m/s, but the path has {:.2f} m/s on average: "
        "lower its speed",
        asset_name(spec_.asset.kind), rig_.most_speed, speed_m_s);
  }
  const double flat_m =
      rig_.stride_s * math::pow(std::max(speed_m_s, rig_.most_speed / 10), rig_.stride_power);
  constexpr double halving_slope = 0.5;
  const double spacing_m = flat_m / 8;
  std::vector<double> strides_m;
  for (double s_m = 0; s_m < path_.length_m() + 2 * spacing_m; s_m += spacing_m) {
    const auto low_m = ground_(path_.at(s_m - flat_m / 2).p);
    const auto high_m = ground_(path_.at(s_m + flat_m / 2).p);
    const double slope = low_m && high_m ? (*high_m - *low_m) / flat_m / halving_slope : 0;
    strides_m.push_back(flat_m / (1 + slope * slope));
  }
  const double begin = AssetRandom(spec_.asset.kind, spec_.asset.seed).between(0, 1);
  return {std::move(strides_m), spacing_m, begin};
}

std::vector<Pose> FigureWalker::pose_at(std::chrono::nanoseconds time) {
  if (path_.length_m() == 0) return standing();
  const double s_m = path_.distance_m(time), moves = motion(time);
  const double size = amplitude(s_m) * moves;
  Pose root = root_at(s_m);
  std::vector<FootPose> feet;
  for (std::size_t i = 0; i < rig_.legs.size(); ++i) {
    feet.push_back(foot_at(i, s_m));
    if (moves == 1) continue;
    feet.back() = lowered(i, s_m, feet.back(), moves);
    root.translation_m.z =
        std::min(root.translation_m.z, root_limit_m(rig_.legs[i], feet.back(), root));
  }
  std::vector<Pose> parts(rig_.parts);
  parts[0] = root;
  for (std::size_t i = 0; i < rig_.legs.size(); ++i) {
    const LegRig& leg = rig_.legs[i];
    pose_leg(leg, root, feet[i].pose(), fold_rad(leg, step_of(i, s_m).phase, size), parts);
    if (leg.parts[3] < 0) continue;
    const glm::dvec3 ball = feet[i].pose() * glm::dvec3(leg.ball, 0, -leg.ankle);
    parts[static_cast<std::size_t>(leg.parts[3])] = {turn(feet[i].yaw_rad, feet[i].toe_up_rad),
                                                     ball};
  }
  pose_joints(rig_, strides_.at(s_m), size, parts);
  return parts;
}

// A path without length: the figure stands, as an object that does not move.
std::vector<Pose> FigureWalker::standing() const {
  const PlanPath::Point at = path_.at(0);
  const Pose X_DO{turn(at.yaw_rad, 0), {at.p, ground_m(at.p)}};
  std::vector<Pose> parts = standing_pose(rig_);
  for (Pose& part : parts) part = X_DO * part;
  return parts;
}

// 1 in a walk, 0 in a pause: rises with the speed about a time.
double FigureWalker::motion(std::chrono::nanoseconds time) const {
  constexpr std::chrono::milliseconds half(250);
  const auto from = std::max(time - half, begin_time_), to = std::min(time + half, end_time_);
  const std::chrono::duration<double> span = to - from;
  const double speed_m_s = (path_.distance_m(to) - path_.distance_m(from)) / span.count();
  return smooth_step(speed_m_s / (rig_.most_speed / 10));
}

FigureWalker::Step FigureWalker::step_of(std::size_t leg, double s_m) const {
  const double strides_since = strides_.at(s_m) - rig_.legs[leg].phase;
  const double number = std::floor(strides_since);
  return {static_cast<long>(number), strides_since - number};
}

double FigureWalker::distance_m(std::size_t leg, long number, double phase) const {
  return strides_.distance_m(static_cast<double>(number) + rig_.legs[leg].phase + phase);
}

double FigureWalker::ground_m(const glm::dvec2& p) const {
  if (const auto z_m = ground_(p)) return *z_m;
  throw Error(
      "a foot of the {} would stand outside the DEM or in a hole at ({:.3f}, {:.3f}) m in W: "
      "move its path",
      asset_name(spec_.asset.kind), spec_.origin_w_m.x + p.x, spec_.origin_w_m.y + p.y);
}

const FigureWalker::Footprint& FigureWalker::footprint(std::size_t number_of_leg, long step) {
  const auto [found, is_new] = footprints_.try_emplace({number_of_leg, step});
  if (!is_new) return found->second;
  const LegRig& leg = rig_.legs[number_of_leg];
  const PlanPath::Point at =
      path_.at(distance_m(number_of_leg, step, rig_.roll.centre) + leg.hip.x + leg.stand_x);
  return found->second = print_at(leg, at.p + along_heading(at.yaw_rad, 0, leg.track), at.yaw_rad);
}

// Footprint of a foot whose ankle is above a point.
FigureWalker::Footprint FigureWalker::print_at(const LegRig& leg, const glm::dvec2& p,
                                               double yaw_rad) const {
  const glm::dvec2 ahead = heading_of(yaw_rad);
  Footprint print{{0, 0, 0}, yaw_rad, 0};
  const double length_m = leg.ball - leg.heel;
  const double low_m = ground_m(p + ahead * leg.heel);
  if (length_m > 0)
    print.up_rad =
        math::asin(std::clamp((ground_m(p + ahead * leg.ball) - low_m) / length_m, -0.7, 0.7));
  const glm::dvec3 heel(p + ahead * leg.heel, low_m);
  print.origin = heel - turn(print.yaw_rad, print.up_rad) * glm::dvec3(leg.heel, 0, 0);
  return print;
}

FigureWalker::FootPose FigureWalker::standing_foot(std::size_t number_of_leg, long step,
                                                   double phase) {
  const LegRig& leg = rig_.legs[number_of_leg];
  const FootRoll& roll = rig_.roll;
  const Footprint& print = footprint(number_of_leg, step);
  const double size = std::min(amplitude(distance_m(number_of_leg, step, phase)), 1.2);
  double up_rad = 0, toe_rad = 0;
  glm::dvec2 ankle(0);
  if (phase < roll.flat) {
    up_rad = size * roll.heel_rad * (1 - smooth_step(phase / roll.flat));
    ankle = glm::dvec2(leg.heel, 0) - pitched({leg.heel, -leg.ankle}, up_rad);
    toe_rad = up_rad;
  } else {
    const double u = std::max(0.0, (phase - roll.rise) / (roll.duty - roll.rise));
    up_rad = -size * roll.push_rad * u * u;
    toe_rad = leg.tip > leg.ball ? toe_pitch(roll, up_rad) : up_rad;
    ankle = glm::dvec2(leg.tip, 0) - pitched({leg.tip - leg.ball, 0}, toe_rad) -
            pitched({leg.ball, -leg.ankle}, up_rad);
  }
  const glm::dvec3 on_print = turn(print.yaw_rad, print.up_rad) * glm::dvec3(ankle.x, 0, ankle.y);
  return {print.origin + on_print, print.yaw_rad, print.up_rad + up_rad, print.up_rad + toe_rad};
}

// Ankle forward of and above the hip in an undisturbed walk on flat ground: by the published angles
// of thigh and knee, or, for a leg of three segments, while it stands, that of the walk itself, and
// while it swings, the cubic curve that continues it.
glm::dvec3 FigureWalker::usual_ankle(const LegRig& leg, double phase, double size) const {
  if (!leg.has_third_segment()) {
    const double thigh = leg.thigh.at(phase, size);
    const double shank = thigh - leg.knee.at(phase, size);
    return {leg.upper * math::sin(thigh) + leg.lower * math::sin(shank), 0,
            -leg.upper * math::cos(thigh) - leg.lower * math::cos(shank)};
  }
  const double duty = rig_.roll.duty, u = (phase - duty) / (1 - duty);
  double ahead = rig_.roll.centre - phase;  // in strides
  if (u > 0) {
    const double back = rig_.roll.centre - duty;
    ahead = back + duty * smooth_step(u) - (1 - duty) * u * (1 - u) * (1 - 2 * u);
  }
  return {leg.stand_x + ahead * size * rig_.usual_stride, 0,
          leg.ankle - leg.hip.z - rig_.stand_height};
}

// Flexion of the carpus: in the swing alone.
double FigureWalker::fold_rad(const LegRig& leg, double phase, double size) const {
  const double duty = rig_.roll.duty;
  return phase <= duty ? 0 : leg.fold_rad * size * bump((phase - duty) / (1 - duty));
}

// Root in plan: position and yaw.
PlanPath::Point FigureWalker::root_in_plan(double s_m) const {
  const PlanPath::Point at = path_.at(s_m);
  const double turn_rad = 2 * pi * strides_.at(s_m), size = amplitude(s_m);
  const double sway = rig_.sway * size * math::sin(turn_rad);
  const double yaw = rig_.root_yaw_deg * size * pi / 180 * math::cos(turn_rad);
  return {at.p + along_heading(at.yaw_rad, 0, sway), at.yaw_rad - yaw};
}

// Largest height of a hip at which its leg reaches the ground: while the foot stands, and, with a
// margin that vanishes, before it lands and after it leaves.
double FigureWalker::reach_m(std::size_t number_of_leg, double s_m, const PlanPath::Point& root,
                             double up_rad) {
  constexpr double fade = 0.08;  // of a stride
  const LegRig& leg = rig_.legs[number_of_leg];
  const auto [number, phase] = step_of(number_of_leg, s_m);
  const double duty = rig_.roll.duty;
  if (phase > duty + fade && phase < 1 - fade) return std::numeric_limits<double>::infinity();
  const bool lands = phase > duty + fade;
  const FootPose foot = lands ? standing_foot(number_of_leg, number + 1, 0)
                              : standing_foot(number_of_leg, number, std::min(phase, duty));
  const double apart = smooth_step((lands ? 1 - phase : phase - duty) / fade);
  const double ahead = pitched({leg.hip.x, leg.hip.z}, up_rad).x;
  const glm::dvec2 hip = root.p + along_heading(root.yaw_rad, ahead, leg.hip.y);
  const glm::dvec2 off = glm::dvec2(foot.ankle) - hip;
  const double length = reach_share * leg.reach();
  return foot.ankle.z + std::sqrt(std::max(length * length - glm::dot(off, off), 0.0)) +
         0.3 * length * apart;
}

// Height of the hips of a pair of legs: that at which the standing legs have the usual posture, or
// the limit of reach if it is lower, smoothly.
double FigureWalker::hip_height_m(std::size_t first, double s_m, const PlanPath::Point& root,
                                  double up_rad) {
  const double size = amplitude(s_m);
  double sum = 0, weights = 0;
  for (std::size_t i = first; i < first + 2; ++i) {
    const auto [number, phase] = step_of(i, s_m);
    const double duty = rig_.roll.duty;
    if (phase >= duty) continue;
    const double weight = smooth_step(phase / 0.12) * smooth_step((duty - phase) / 0.12) + 1e-9;
    const LegRig& leg = rig_.legs[i];
    const double ankle_m = leg.has_third_segment() ? footprint(i, number).origin.z + leg.ankle
                                                   : standing_foot(i, number, phase).ankle.z;
    sum += weight * (ankle_m - usual_ankle(leg, phase, size).z);
    weights += weight;
  }
  const std::array<double, 3> heights = {sum / weights, reach_m(first, s_m, root, up_rad),
                                         reach_m(first + 1, s_m, root, up_rad)};
  const double width = soft_share * rig_.stand_height;
  const double least = std::ranges::min(heights);
  double total = 0;
  for (const double z : heights) total += math::exp((least - z) / width);
  return least - width * math::log(total);
}

Pose FigureWalker::root_at(double s_m) {
  const auto found = roots_.find(s_m);
  if (found != roots_.end()) return found->second;
  const PlanPath::Point root = root_in_plan(s_m);
  const LegRig& first = rig_.legs.front();
  double hip_m = 0, up_rad = 0;
  // The pitch follows from the heights of both pairs of hips, which it changes little.
  const int rounds = rig_.legs.size() > 2 ? 3 : 1;
  for (int i = 0; i < rounds; ++i) {
    hip_m = hip_height_m(0, s_m, root, up_rad);
    if (rounds == 1) break;
    const glm::dvec3 apart = first.hip - rig_.legs.back().hip;
    const double rise_m = hip_m - hip_height_m(rig_.legs.size() - 2, s_m, root, up_rad);
    const double sine = rise_m / std::sqrt(apart.x * apart.x + apart.z * apart.z);
    up_rad = math::asin(std::clamp(sine, -0.9, 0.9)) - math::atan2(apart.z, apart.x);
  }
  const Pose pose{turn(root.yaw_rad, up_rad),
                  {root.p, hip_m - pitched({first.hip.x, first.hip.z}, up_rad).y}};
  if (roots_.size() > 64) roots_.clear();
  roots_.emplace(s_m, pose);
  return pose;
}

// Position of an ankle relative to its hip, in the frame of the path's heading.
glm::dvec3 FigureWalker::from_hip(const LegRig& leg, const glm::dvec3& ankle, double s_m) {
  const glm::dvec3 off = ankle - root_at(s_m) * leg.hip;
  return {along_heading(-path_.at(s_m).yaw_rad, off.x, off.y), off.z};
}

FigureWalker::FootPose FigureWalker::swinging_foot(std::size_t number_of_leg, long step,
                                                   double phase, double s_m) {
  const LegRig& leg = rig_.legs[number_of_leg];
  const double duty = rig_.roll.duty;
  constexpr double little = 1e-4;
  const double before_m = distance_m(number_of_leg, step, duty - little);
  const double up_m = distance_m(number_of_leg, step, duty);
  const double down_m = distance_m(number_of_leg, step + 1, 0);
  const double size = amplitude(s_m), up_size = amplitude(up_m), down_size = amplitude(down_m);
  const FootPose up = standing_foot(number_of_leg, step, duty);
  const FootPose before = standing_foot(number_of_leg, step, duty - little);
  const FootPose down = standing_foot(number_of_leg, step + 1, 0);
  const double swing = 1 - duty, u = (phase - duty) / swing;
  const double v = std::min(u / catch_up, 1.0), rest = 1 - smooth_step(v);
  const double slope = slope_share * catch_up * v * (1 - v) * (1 - v) * swing / little;
  // Differences from the usual curve when the foot takes off and when it lands.
  const glm::dvec3 e0 = from_hip(leg, up.ankle, up_m) - usual_ankle(leg, duty, up_size);
  const glm::dvec3 e_before =
      from_hip(leg, before.ankle, before_m) - usual_ankle(leg, duty - little, up_size);
  const glm::dvec3 e1 = from_hip(leg, down.ankle, down_m) - usual_ankle(leg, 1, down_size);
  glm::dvec3 off =
      usual_ankle(leg, phase, size) + e0 * rest + (e0 - e_before) * slope + e1 * smooth_step(u);
  off.z += rig_.roll.lift * size * bump(u);
  off *= std::min(1.0, reach_share * leg.reach(fold_rad(leg, phase, size)) / glm::length(off));
  const double g0 = up.up_rad - leg.foot.at(duty, up_size);
  const double g_before = before.up_rad - leg.foot.at(duty - little, up_size);
  const double g1 = down.up_rad - leg.foot.at(1, down_size);
  FootPose foot;
  foot.ankle = root_at(s_m) * leg.hip +
               glm::dvec3(along_heading(path_.at(s_m).yaw_rad, off.x, off.y), off.z);
  foot.yaw_rad = up.yaw_rad + smooth_step(u) * std::remainder(down.yaw_rad - up.yaw_rad, 2 * pi);
  foot.up_rad =
      leg.foot.at(phase, size) + g0 * rest + (g0 - g_before) * slope + g1 * smooth_step(u);
  foot.toe_up_rad = foot.up_rad + (up.toe_up_rad - up.up_rad) * (1 - smooth_step(u * swing / 0.15));
  return foot;
}

// A foot that swings or lands, put down where it is as the motion ends.
FigureWalker::FootPose FigureWalker::lowered(std::size_t number_of_leg, double s_m,
                                             const FootPose& foot, double motion) {
  const LegRig& leg = rig_.legs[number_of_leg];
  const auto [step, phase] = step_of(number_of_leg, s_m);
  if (phase >= rig_.roll.flat && phase <= rig_.roll.duty) return foot;
  const Footprint print = phase < rig_.roll.flat
                              ? footprint(number_of_leg, step)
                              : print_at(leg, glm::dvec2(foot.ankle), foot.yaw_rad);
  const glm::dvec3 flat =
      print.origin + turn(print.yaw_rad, print.up_rad) * glm::dvec3(0, 0, leg.ankle);
  return {glm::mix(flat, foot.ankle, motion), foot.yaw_rad,
          std::lerp(print.up_rad, foot.up_rad, motion),
          std::lerp(print.up_rad, foot.toe_up_rad, motion)};
}

// Largest height of the root at which a leg reaches its foot.
double FigureWalker::root_limit_m(const LegRig& leg, const FootPose& foot, const Pose& root) const {
  const glm::dvec3 hip = root * leg.hip;
  const glm::dvec2 off = glm::dvec2(foot.ankle - hip);
  const double length = reach_share * leg.reach();
  return root.translation_m.z + foot.ankle.z - hip.z +
         std::sqrt(std::max(length * length - glm::dot(off, off), 0.0));
}

FigureWalker::FootPose FigureWalker::foot_at(std::size_t number_of_leg, double s_m) {
  const auto [number, phase] = step_of(number_of_leg, s_m);
  return phase <= rig_.roll.duty ? standing_foot(number_of_leg, number, phase)
                                 : swinging_foot(number_of_leg, number, phase, s_m);
}

}  // namespace groundray
