// A walking or standing person. Lengths and heights of segments are fractions of stature of Drillis
// and Contini (1966), as in Winter, Biomechanics and Motor Control of Human Movement, figure 4.1;
// girths and the shape of clothes, hands and face are our own.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <string_view>

#include "core/math.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_solid.h"
#include "terrain/assets/figure_rig.h"

namespace groundray {
namespace {

// Dimensions in units of stature.
struct Build {
  static constexpr double thigh = 0.245, shank = 0.246, ankle = 0.039, foot_length = 0.152;
  static constexpr double upper_arm = 0.186, forearm = 0.146, hand = 0.108;
  static constexpr double hip_height = thigh + shank + ankle, shoulder_height = 0.818;
  static constexpr double heel = -0.039, ball = 0.072, tip = heel + foot_length;
  static constexpr double waist = 0.075, hip_y = 0.05, shoulder_y = 0.108;
  static constexpr double shoulder_z = shoulder_height - hip_height - waist;  // above the waist
};

enum PersonPart {
  Pelvis,
  Trunk,
  Head,
  UpperArmL,
  UpperArmR,
  ForearmL,
  ForearmR,
  ThighL,
  ThighR,
  ShankL,
  ShankR,
  FootL,
  FootR,
  ToesL,
  ToesR,
  Count
};

// Fourier series of degree 5 of curves over the stride, degrees: hip after key values of Perry and
// Burnfield, Gait Analysis (2010), less 10 degrees of pelvic tilt; knee after Schwartz et al.
// (2008), children; foot: hip less knee plus ankle, the ankle also after Perry and Burnfield.
constexpr AngleSeries thigh_deg = {
    3.98, {20.13, -3.20, -4.62, -3.17, -0.23, 1.46, 0.86, 0.54, -0.14, -0.71}};
constexpr AngleSeries knee_deg = {
    23.34, {-1.98, -18.90, -14.12, 6.96, -0.62, 4.52, -0.89, 0.64, -0.60, 0.74}};
constexpr AngleSeries ankle_deg = {
    0.67, {-2.72, 4.73, 1.10, -5.73, -1.72, 0.62, 2.33, 0.04, -0.47, -1.08}};

constexpr AngleSeries foot_series() {
  AngleSeries sum{thigh_deg.mean - knee_deg.mean + ankle_deg.mean, {}};
  for (std::size_t i = 0; i < sum.harmonics.size(); ++i)
    sum.harmonics[i] = thigh_deg.harmonics[i] - knee_deg.harmonics[i] + ankle_deg.harmonics[i];
  return sum;
}

// Clothes of a variant: linear sRGB, our own choice.
struct Outfit {
  glm::vec3 jacket, trousers, shoes, skin, hair;
};
constexpr std::array<Outfit, 5> outfits = {{
    {{0.06f, 0.11f, 0.22f},
     {0.09f, 0.08f, 0.065f},
     {0.05f, 0.035f, 0.025f},
     {0.45f, 0.25f, 0.17f},
     {0.05f, 0.03f, 0.02f}},
    {{0.45f, 0.10f, 0.05f},
     {0.03f, 0.04f, 0.07f},
     {0.03f, 0.03f, 0.03f},
     {0.30f, 0.16f, 0.10f},
     {0.015f, 0.012f, 0.01f}},
    {{0.10f, 0.15f, 0.06f},
     {0.20f, 0.16f, 0.10f},
     {0.10f, 0.06f, 0.03f},
     {0.50f, 0.29f, 0.20f},
     {0.22f, 0.14f, 0.06f}},
    {{0.60f, 0.42f, 0.04f},
     {0.05f, 0.05f, 0.05f},
     {0.04f, 0.04f, 0.04f},
     {0.12f, 0.06f, 0.035f},
     {0.01f, 0.01f, 0.01f}},
    {{0.35f, 0.36f, 0.37f},
     {0.02f, 0.03f, 0.05f},
     {0.30f, 0.30f, 0.30f},
     {0.40f, 0.22f, 0.15f},
     {0.12f, 0.10f, 0.09f}},
}};

// One part of a person, of unit stature, in the frame of its upper joint.
class PersonShape {
 public:
  PersonShape(AssetBuilder& builder, const AssetShape& shape) : builder_(builder) {
    AssetRandom random = shape.random;
    random.between(0, 1);  // the phase of the gait
    outfit_ = &outfits[static_cast<std::size_t>(random.between(0, outfits.size()))];
    girth_ = random.between(0.94, 1.1);
    fineness_ = 1 / std::sqrt(shape.detail);
  }

  void add(std::size_t part) {
    const double side = part >= UpperArmL && part % 2 == UpperArmR % 2 ? -1 : 1;
    switch (part) {
      case Pelvis:
        return add_pelvis();
      case Trunk:
        return add_trunk();
      case Head:
        return add_head();
      case UpperArmL:
      case UpperArmR:
        return add_upper_arm();
      case ForearmL:
      case ForearmR:
        return add_forearm(side);
      case ThighL:
      case ThighR:
        return add_thigh();
      case ShankL:
      case ShankR:
        return add_shank();
      case FootL:
      case FootR:
        return add_foot(side);
      default:
        return add_toes(side);
    }
  }

 private:
  void solid(const Solid& of, const glm::dvec3& low, const glm::dvec3& high, double cell,
             std::string_view name, const glm::vec3& color) {
    const bool is_clothed = name == "jacket" || name == "trousers";
    const glm::dvec3 girth = is_clothed ? glm::dvec3(girth_, girth_, 1) : glm::dvec3(1);
    const double least = std::min(girth.x, 1.0);
    const auto wide = [&](const glm::dvec3& p) { return least * of(p / girth); };
    add_solid(builder_, wide, {low * girth, high * girth, cell * fineness_},
              builder_.surface(name, color));
  }

  void add_pelvis() {
    const auto body = [](const glm::dvec3& p) {
      double d = ellipsoid(p, {-0.004, 0, 0.035}, {0.060, 0.092, 0.060});
      for (const double y : {-0.043, 0.043}) {
        d = blend(d, glm::distance(p, {0.000, y, -0.005}) - 0.051, 0.03);
        d = blend(d, ellipsoid(p, {-0.030, y * 0.9, -0.004}, {0.040, 0.042, 0.046}), 0.02);
      }
      return d;
    };
    solid(body, {-0.09, -0.11, -0.07}, {0.08, 0.11, 0.11}, 0.010, "trousers", outfit_->trousers);
  }

  void add_trunk() {
    const auto body = [](const glm::dvec3& p) {
      double d = ellipsoid(p, {0.004, 0, 0.135}, {0.062, 0.090, 0.105});             // chest
      d = blend(d, ellipsoid(p, {0.004, 0, 0.01}, {0.059, 0.084, 0.09}), 0.05);      // belly
      d = blend(d, ellipsoid(p, {-0.004, 0, -0.055}, {0.074, 0.104, 0.085}), 0.04);  // hem
      const glm::dvec3 high{-0.010, Build::shoulder_y - 0.012, Build::shoulder_z - 0.003};
      d = blend(d, round_cone(p, high, 0.033, high * glm::dvec3(1, -1, 1), 0.033), 0.03);
      d = blend(d, round_cone(p, {-0.012, 0, 0.185}, 0.05, {-0.006, 0, 0.226}, 0.035), 0.04);
      return blend_cut(d, -0.092 - p.z, 0.008);
    };
    solid(body, {-0.09, -0.16, -0.11}, {0.09, 0.16, 0.29}, 0.010, "jacket", outfit_->jacket);
  }

  void add_head() {
    const auto skull = [](const glm::dvec3& p) {
      double d = ellipsoid(p, {0.008, 0, 0.108}, {0.056, 0.043, 0.050});
      d = blend(d, ellipsoid(p, {0.028, 0, 0.074}, {0.035, 0.033, 0.040}), 0.02);   // face
      d = blend(d, ellipsoid(p, {0.046, 0, 0.047}, {0.014, 0.018, 0.012}), 0.015);  // chin
      d = blend(d, round_cone(p, {-0.006, 0, -0.01}, 0.033, {0.000, 0, 0.07}, 0.029), 0.02);
      const glm::dvec3 eye{0.068, std::abs(p.y) - 0.0185, 0.093};
      d = blend_cut(d, 0.0075 - glm::length(glm::dvec3(p.x - eye.x, eye.y, p.z - eye.z)), 0.008);
      d = blend(d, round_cone(p, {0.060, 0, 0.094}, 0.005, {0.071, 0, 0.073}, 0.0075), 0.008);
      d = blend(d, ellipsoid(p, {0.061, 0, 0.0555}, {0.006, 0.014, 0.0045}), 0.006);  // lips
      return d;
    };
    solid(skull, {-0.06, -0.05, -0.05}, {0.09, 0.05, 0.165}, 0.005, "skin", outfit_->skin);
    const auto hair = [](const glm::dvec3& p) {
      double d = ellipsoid(p, {0.004, 0, 0.110}, {0.060, 0.0475, 0.050});
      const glm::dvec2 from(p.x - 0.060, p.z - 0.126);
      return blend_cut(d, glm::dot(from, glm::normalize(glm::dvec2(0.57, -0.82))), 0.006);
    };
    solid(hair, {-0.06, -0.05, 0.03}, {0.075, 0.05, 0.162}, 0.006, "hair", outfit_->hair);
    const auto ears = [](const glm::dvec3& p) {
      return ellipsoid({p.x - 0.25 * (p.z - 0.08), std::abs(p.y), p.z}, {0.006, 0.0435, 0.080},
                       {0.010, 0.006, 0.017});
    };
    solid(ears, {-0.02, -0.052, 0.06}, {0.03, 0.052, 0.1}, 0.005, "skin", outfit_->skin);
  }

  void add_upper_arm() {
    const auto arm = [](const glm::dvec3& p) {
      double d = round_cone(p, {0, 0, -0.002}, 0.033, {0, 0, -Build::upper_arm}, 0.0262);
      return blend(d, ellipsoid(p, {0.004, 0, -0.085}, {0.031, 0.029, 0.06}), 0.02);
    };
    solid(arm, {-0.05, -0.05, -0.23}, {0.05, 0.05, 0.05}, 0.009, "jacket", outfit_->jacket);
  }

  void add_forearm(double side) {
    const auto sleeve = [](const glm::dvec3& p) {
      double d = round_cone(p, {0, 0, 0}, 0.0255, {0.002, 0, -0.045}, 0.0255);
      d = blend(d,
                round_cone(p, {0.002, 0, -0.04}, 0.0255, {0, 0, -Build::forearm + 0.022}, 0.0225),
                0.02);
      return blend_cut(d, -Build::forearm + 0.012 - p.z, 0.006);
    };
    solid(sleeve, {-0.05, -0.05, -Build::forearm}, {0.05, 0.05, 0.04}, 0.009, "jacket",
          outfit_->jacket);
    const auto palm = [side](const glm::dvec3& q) {
      const glm::dvec3 p{q.x, q.y * side, q.z + Build::forearm};  // thumbs forward, palms inward
      double d = round_cone({p.x, p.y * 1.25, p.z}, {0, 0, 0.03}, 0.0165, {0, 0, 0.0}, 0.0155);
      d = blend(d, ellipsoid(p, {0.001, 0, -0.030}, {0.0235, 0.0105, 0.034}), 0.012);
      for (int i = 0; i < 4; ++i) {
        constexpr std::array<double, 4> lengths = {0.012, 0.004, 0.0, 0.006};
        const double x = -0.0165 + 0.011 * i;
        const double end = -Build::hand + 0.006 + lengths[static_cast<std::size_t>(i)];
        const double mid = (end - 0.055) / 2;
        d = blend(
            d,
            std::min(round_cone(p, {x, 0, -0.050}, 0.0062, {x, -0.005, mid - 0.004}, 0.0056),
                     round_cone(p, {x, -0.005, mid - 0.004}, 0.0056, {x, -0.018, end}, 0.0046)),
            0.004);
      }
      return blend(d,
                   round_cone(p, {0.016, -0.004, -0.012}, 0.0085, {0.030, -0.012, -0.055}, 0.0055),
                   0.008);
    };
    solid(palm, {-0.03, -0.03, -Build::forearm - Build::hand - 0.002},
          {0.04, 0.03, -Build::forearm + 0.05}, 0.0042, "skin", outfit_->skin);
  }

  void add_thigh() {
    const auto leg = [](const glm::dvec3& p) {
      double d = round_cone(p, {0, 0, -0.005}, 0.050, {0.002, 0, -Build::thigh}, 0.0365);
      return blend(d, ellipsoid(p, {0.008, 0, -0.09}, {0.050, 0.050, 0.10}), 0.03);
    };
    solid(leg, {-0.08, -0.08, -0.31}, {0.08, 0.08, 0.07}, 0.011, "trousers", outfit_->trousers);
  }

  void add_shank() {
    const auto leg = [](const glm::dvec3& p) {
      double d = round_cone(p, {0.002, 0, 0}, 0.0365, {-0.004, 0, -Build::shank + 0.02}, 0.031);
      d = blend(d, ellipsoid(p, {-0.010, 0, -0.08}, {0.036, 0.035, 0.08}), 0.03);
      return blend_cut(d, -Build::shank + 0.006 - p.z, 0.006);
    };
    solid(leg, {-0.07, -0.06, -Build::shank - 0.01}, {0.06, 0.06, 0.05}, 0.010, "trousers",
          outfit_->trousers);
  }

  // Outline of the sole, seen from above, narrower at the heel.
  static double sole(const glm::dvec3& p, double side) {
    const double share = glm::clamp((p.x - Build::heel) / (Build::tip - Build::heel), 0.0, 1.0);
    const double half = 0.0205 + 0.009 * smooth_step((share - 0.15) / 0.5);
    const double bow = side * (-0.006 * smooth_step((share - 0.6) / 0.4) + 0.002);
    const glm::dvec2 q(p.x - (Build::heel + Build::tip) / 2, p.y - bow);
    const double reach = (Build::tip - Build::heel) / 2 - half;
    const glm::dvec2 off(std::max(std::abs(q.x) - reach, 0.0), q.y);
    return 0.7 * (glm::length(off) - half);
  }

  void add_foot(double side) {
    const auto shoe = [side](const glm::dvec3& p) {
      double upper = round_cone(p, {-0.004, 0, -0.002}, 0.026, {0.056, 0, -0.026}, 0.017);
      upper =
          blend(upper, round_cone(p, {-0.014, 0, -0.018}, 0.024, {0.01, 0, -0.02}, 0.023), 0.01);
      upper = blend(upper, round_cone(p, {0.03, 0, -0.022}, 0.021, {Build::ball, 0, -0.028}, 0.016),
                    0.01);
      upper = blend_cut(upper, sole(p, side) - 0.001, 0.006);
      double d =
          blend(upper, blend_cut(sole(p, side), std::abs(p.z + 0.033) - 0.006, 0.004), 0.006);
      d = blend_cut(d, p.x - Build::ball - 0.006, 0.004);
      d = blend_cut(d, p.z - 0.012, 0.004);
      return blend_cut(d, -Build::ankle - p.z, 0.003);
    };
    solid(shoe, {-0.045, -0.035, -0.042}, {0.085, 0.035, 0.02}, 0.0065, "shoes", outfit_->shoes);
  }

  void add_toes(double side) {
    const auto cap = [side](const glm::dvec3& q) {
      const glm::dvec3 p{q.x + Build::ball, q.y, q.z - Build::ankle};  // in the foot's frame
      double d = round_cone(p, {Build::ball - 0.005, 0, -0.0255}, 0.0185,
                            {Build::tip - 0.022, 0, -0.030}, 0.014);
      d = blend(d, ellipsoid(p, {0.082, 0, -0.031}, {0.034, 0.0285, 0.014}), 0.01);
      d = blend_cut(d, sole(p, side) - 0.0005, 0.005);
      d = blend(d, blend_cut(sole(p, side), std::abs(p.z + 0.033) - 0.006, 0.004), 0.006);
      d = blend_cut(d, Build::ball - 0.008 - p.x, 0.004);
      return blend_cut(d, -Build::ankle - p.z, 0.003);
    };
    solid(cap, {-0.02, -0.035, -0.003}, {0.05, 0.035, 0.045}, 0.0065, "shoes", outfit_->shoes);
  }

  AssetBuilder& builder_;
  const Outfit* outfit_ = nullptr;
  double girth_ = 1, fineness_ = 1;
};

}  // namespace

FigureRig person_rig(const AssetShape& /*shape*/) {
  FigureRig rig;
  rig.parts = Count;
  for (int i = 0; i < 2; ++i) {
    const double side = i == 0 ? 1 : -1;
    rig.legs.push_back({.parts = {ThighL + i, ShankL + i, FootL + i, ToesL + i},
                        .hip = {0, side * Build::hip_y, 0},
                        .upper = Build::thigh,
                        .lower = Build::shank,
                        .ankle = Build::ankle,
                        .heel = Build::heel,
                        .ball = Build::ball,
                        .tip = Build::tip,
                        .track = side * 0.03,
                        .stand_y = side * 0.2 * Build::hip_y,
                        .splay_deg = side * 7,
                        .phase = i * 0.5,
                        .thigh = thigh_deg,
                        .knee = knee_deg,
                        .foot = foot_series()});
  }
  // Arms swing opposite to the leg of their side: amplitudes and rest angles are our own.
  rig.joints = {
      {.part = Trunk, .parent = Pelvis, .at = {0, 0, Build::waist}, .pitch_deg = -3, .yaw_deg = 8},
      {.part = Head, .parent = Trunk, .at = {-0.006, 0, 0.238}, .pitch_deg = 3, .yaw_deg = -4}};
  for (int i = 0; i < 2; ++i) {
    const double side = i == 0 ? 1 : -1;
    rig.joints.push_back({.part = UpperArmL + i,
                          .parent = Trunk,
                          .at = {-0.008, side * Build::shoulder_y, Build::shoulder_z},
                          .roll_deg = side * 8,
                          .pitch_deg = -3,
                          .swing_deg = 18,
                          .phase = 0.5 + i * 0.5});
    rig.joints.push_back({.part = ForearmL + i,
                          .parent = UpperArmL + i,
                          .at = {0, 0, -Build::upper_arm},
                          .roll_deg = side * -4,
                          .pitch_deg = 22,
                          .swing_deg = 10,
                          .phase = 0.5 + i * 0.5 - 0.06});
  }
  rig.roll = {.duty = 0.62,
              .flat = 0.12,
              .rise = 0.31,
              .heel_rad = 0.238,
              .push_rad = 1.08,
              .toe_rad = 0.433,
              .centre = 0.222,
              .lift = 0.0148};
  rig.stand_height = Build::hip_height - 0.003;
  rig.sway = 0.011;
  rig.root_yaw_deg = 4;
  // Cited from Perry and Burnfield: 1.41 m at 82 m/min, taken for a stature of 1.75 m. The power of
  // the speed and the Froude number of 0.5 at which walks end are our own choice.
  constexpr double usual_m = 1.41, usual_m_s = 82.0 / 60, stature_m = 1.75;
  rig.usual_stride = usual_m / stature_m;
  rig.stride_power = 0.42;
  rig.stride_s = rig.usual_stride / math::pow(usual_m_s / std::sqrt(stature_m), rig.stride_power);
  rig.most_speed = std::sqrt(0.5 * 9.81 * Build::hip_height);
  return rig;
}

Model make_person_part(const AssetShape& shape, std::size_t part) {
  AssetBuilder builder;
  PersonShape(builder, shape).add(part);
  builder.smooth();
  return builder.take();
}

}  // namespace groundray
