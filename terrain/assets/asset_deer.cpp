// A walking or standing deer without antlers, of the proportions of a red deer hind: shoulder
// height 1.14 m, length of head and body 1.80 m. The split of these lengths among the bones, girths
// and coats are our own.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_solid.h"
#include "terrain/assets/figure_rig.h"

namespace groundray {
namespace {

// Dimensions in units of the height of the withers above the ground.
struct Frame {
  static constexpr double root_z = 0.79;  // of the trunk's origin, between the hips
  static constexpr double scapula = 0.25, humerus = 0.20, radius = 0.245, metacarpus = 0.215;
  static constexpr double femur = 0.25, tibia = 0.295, metatarsus = 0.255;
  static constexpr double fetlock = 0.085;            // its height above the ground
  static constexpr double hoof = 0.022, tip = 0.085;  // heel and tip, ahead of the fetlock
  static constexpr double neck = 0.42, head = 0.315;
  static constexpr double neck_x = 0.36;
};

enum DeerPart {
  Torso,
  Neck,
  Skull,
  ScapulaL,
  ScapulaR,
  HumerusL,
  HumerusR,
  RadiusL,
  RadiusR,
  MetacarpusL,
  MetacarpusR,
  ForeHoofL,
  ForeHoofR,
  FemurL,
  FemurR,
  TibiaL,
  TibiaR,
  MetatarsusL,
  MetatarsusR,
  HindHoofL,
  HindHoofR,
  DeerParts
};

// What a variant selects.
struct DeerVariant {
  glm::vec3 coat;
  double girth = 1, neck_deg = 0, head_deg = 0;  // pitches above the horizontal while standing

  explicit DeerVariant(AssetRandom random) {
    // Linear sRGB: summer and winter coats.
    constexpr std::array<glm::vec3, 4> coats = {{{0.26f, 0.12f, 0.05f},
                                                 {0.20f, 0.10f, 0.05f},
                                                 {0.17f, 0.13f, 0.09f},
                                                 {0.12f, 0.085f, 0.055f}}};
    random.between(0, 1);  // the phase of the gait
    coat = coats[static_cast<std::size_t>(random.between(0, coats.size()))];
    girth = random.between(0.93, 1.07);
    constexpr std::array<glm::dvec2, 3> bearings_deg = {
        {{58, -22}, {36, -28}, {-50, -78}}};  // alert, at rest, grazing
    const auto& bearing =
        bearings_deg[static_cast<std::size_t>(random.between(0, bearings_deg.size()))];
    neck_deg = bearing.x;
    head_deg = bearing.y;
  }
};

// One part of a deer, of unit height, in the frame of its upper joint. Bones hang along -z; neck
// and head lie along x.
class DeerShape {
 public:
  DeerShape(AssetBuilder& builder, const AssetShape& shape)
      : builder_(builder), variant_(shape.random) {}

  void add(std::size_t part) {
    switch (part) {
      case Torso:
        return add_torso();
      case Neck:
        return add_neck();
      case Skull:
        return add_skull();
      case ScapulaL:
      case ScapulaR:
        return add_bone(0.020, Frame::scapula, [](const glm::dvec3& p) {
          return blend(ellipsoid(p, {0.0, 0, -0.13}, {0.095, 0.036, 0.165}),
                       round_cone(p, {0, 0, -0.1}, 0.045, {0, 0, -Frame::scapula}, 0.055), 0.04);
        });
      case HumerusL:
      case HumerusR:
        return add_bone(0.018, Frame::humerus, [](const glm::dvec3& p) {
          return round_cone(p, {0, 0, 0}, 0.058, {-0.005, 0, -Frame::humerus}, 0.043);
        });
      case RadiusL:
      case RadiusR:
        return add_bone(0.011, Frame::radius, [](const glm::dvec3& p) {
          const double d = round_cone(p, {0, 0, 0}, 0.042, {0.002, 0, -Frame::radius}, 0.021);
          return blend(d, ellipsoid(p, {0.006, 0, -0.05}, {0.042, 0.036, 0.09}), 0.03);
        });
      case MetacarpusL:
      case MetacarpusR:
        return add_bone(0.007, Frame::metacarpus, [](const glm::dvec3& p) {
          const double d = round_cone(p, {0, 0, 0}, 0.0225, {0, 0, -0.045}, 0.0165);
          return blend(d, round_cone(p, {0, 0, -0.04}, 0.0155, {0, 0, -Frame::metacarpus}, 0.0175),
                       0.02);
        });
      case FemurL:
      case FemurR:
        return add_bone(0.020, Frame::femur, [](const glm::dvec3& p) {
          const double d = ellipsoid(p, {-0.035, 0, -0.07}, {0.130, 0.054, 0.180});
          return blend(d, round_cone(p, {-0.02, 0, -0.1}, 0.066, {-0.005, 0, -Frame::femur}, 0.050),
                       0.06);
        });
      case TibiaL:
      case TibiaR:
        return add_bone(0.013, Frame::tibia, [](const glm::dvec3& p) {
          const double d = round_cone(p, {0, 0, 0}, 0.048, {0, 0, -Frame::tibia}, 0.022);
          return blend(d, ellipsoid(p, {-0.025, 0, -0.06}, {0.062, 0.042, 0.13}), 0.04);
        });
      case MetatarsusL:
      case MetatarsusR:
        return add_bone(0.0075, Frame::metatarsus, [](const glm::dvec3& p) {
          double d = round_cone(p, {0, 0, 0}, 0.024, {0.002, 0, -0.06}, 0.018);
          d = blend(d, round_cone(p, {0.002, 0, -0.05}, 0.017, {0, 0, -Frame::metatarsus}, 0.018),
                    0.02);
          return blend(d, round_cone(p, {-0.008, 0, -0.02}, 0.016, {-0.030, 0, 0.028}, 0.013),
                       0.015);
        });
      default:
        return add_hoof();
    }
  }

 private:
  void solid(const Solid& of, const glm::dvec3& low, const glm::dvec3& high, double cell,
             std::string_view name = "fur") {
    constexpr glm::vec3 dark(0.02f, 0.017f, 0.015f);
    add_solid(builder_, of, {low, high, cell},
              builder_.surface(name, name == "fur" ? variant_.coat : dark));
  }

  void add_bone(double cell, double length, const Solid& of) {
    solid(of, {-0.18, -0.09, -length - 0.08}, {0.12, 0.09, 0.09}, cell);
  }

  void add_torso() {
    const auto body = [girth = variant_.girth](const glm::dvec3& q) {
      const glm::dvec3 p(q.x, q.y / girth, q.z);
      double d = ellipsoid(p, {0.19, 0, -0.035}, {0.27, 0.108, 0.195});            // ribs
      d = blend(d, ellipsoid(p, {-0.07, 0, -0.005}, {0.30, 0.102, 0.150}), 0.08);  // belly
      d = blend(d, ellipsoid(p, {-0.33, 0, 0.03}, {0.160, 0.106, 0.150}), 0.06);   // croup
      d = blend(d, ellipsoid(p, {0.35, 0, 0.00}, {0.090, 0.072, 0.140}), 0.06);    // breast
      d = blend(d, round_cone(p, {0.27, 0, 0.164}, 0.044, {0.02, 0, 0.130}, 0.044),
                0.05);  // withers
      d = blend(d, round_cone(p, {0.02, 0, 0.130}, 0.044, {-0.30, 0, 0.140}, 0.044), 0.05);
      d = blend(d, round_cone(p, {-0.462, 0, 0.10}, 0.023, {-0.495, 0, -0.015}, 0.017),
                0.02);  // tail
      return std::min(girth, 1.0) * d;
    };
    solid(body, {-0.56, -0.16, -0.27}, {0.48, 0.16, 0.24}, 0.018);
  }

  void add_neck() {
    const auto neck = [](const glm::dvec3& q) {
      const glm::dvec3 p(q.x, q.y * 1.35, q.z);
      double d = round_cone(p, {-0.04, 0, -0.045}, 0.125, {0.17, 0, -0.008}, 0.078);
      d = blend(d, round_cone(p, {0.14, 0, -0.005}, 0.085, {Frame::neck, 0, 0}, 0.058), 0.05);
      return d / 1.35;
    };
    solid(neck, {-0.19, -0.115, -0.195}, {Frame::neck + 0.07, 0.11, 0.12}, 0.016);
  }

  void add_skull() {
    const auto skull = [](const glm::dvec3& p) {
      double d = ellipsoid(p, {0.055, 0, 0.008}, {0.085, 0.052, 0.058});
      d = blend(d, round_cone(p, {0.09, 0, 0.0}, 0.046, {0.285, 0, -0.028}, 0.027), 0.04);
      d = blend(d, round_cone(p, {0.06, 0, -0.045}, 0.028, {0.22, 0, -0.045}, 0.018), 0.03);  // jaw
      const glm::dvec3 m(p.x, std::abs(p.y), p.z);
      return blend(d, ellipsoid(m, {0.095, 0.042, 0.028}, {0.026, 0.014, 0.016}), 0.01);  // brows
    };
    solid(skull, {-0.04, -0.07, -0.09}, {Frame::head + 0.01, 0.07, 0.08}, 0.009);
    const auto ears = [](const glm::dvec3& p) {
      // Leaves that stand out to the sides and back.
      const glm::dvec3 from(p.x - 0.005, std::abs(p.y) - 0.035, p.z - 0.045);
      constexpr glm::dvec3 along(-0.33, 0.76, 0.56), normal(0.86, 0.0, 0.51);
      const double u = glm::dot(from, along), w = glm::dot(from, normal);
      const double v = glm::dot(from, glm::cross(along, normal));
      return 0.9 * ellipsoid({u, v, w}, {0.075, 0, 0}, {0.083, 0.034, 0.010});
    };
    solid(ears, {-0.08, -0.18, 0.02}, {0.06, 0.18, 0.16}, 0.008);
    const auto eyes = [](const glm::dvec3& p) {
      return glm::distance(glm::dvec3(p.x, std::abs(p.y), p.z), {0.103, 0.046, 0.022}) - 0.0135;
    };
    solid(eyes, {0.08, -0.065, 0.0}, {0.13, 0.065, 0.04}, 0.006, "hoof");
    const auto nose = [](const glm::dvec3& p) {
      return ellipsoid(p, {0.300, 0, -0.023}, {0.016, 0.021, 0.018});
    };
    solid(nose, {0.28, -0.03, -0.05}, {0.32, 0.03, 0.01}, 0.006, "hoof");
  }

  void add_hoof() {
    const auto pastern = [](const glm::dvec3& p) {
      const double d = ellipsoid(p, {-0.004, 0, -0.002}, {0.022, 0.021, 0.022});
      return blend(d, round_cone(p, {0.004, 0, -0.008}, 0.0165, {0.042, 0, -0.055}, 0.0175), 0.01);
    };
    solid(pastern, {-0.035, -0.03, -0.08}, {0.065, 0.03, 0.03}, 0.006);
    const auto claws = [](const glm::dvec3& p) {
      const glm::dvec3 m(p.x, std::abs(p.y), p.z);  // a pair, with a gap
      double d = round_cone(m, {0.046, 0.012, -0.062}, 0.0185, {0.070, 0.010, -0.085}, 0.0145);
      d = blend(d, round_cone(m, {0.036, 0.012, -0.072}, 0.016, {0.040, 0.012, -0.085}, 0.016),
                0.01);
      d = blend_cut(d, 0.0015 - m.y, 0.003);
      return blend_cut(d, -Frame::fetlock - p.z, 0.002);
    };
    solid(claws, {0.015, -0.035, -Frame::fetlock - 0.004}, {0.09, 0.035, -0.04}, 0.005, "hoof");
  }

  AssetBuilder& builder_;
  DeerVariant variant_;
};

constexpr double leg_degree = std::numbers::pi / 180;

LegRig fore_leg(int k, double side) {
  return {.parts = {ScapulaL + k, HumerusL + k, ForeHoofL + k, -1},
          .third_parts = {RadiusL + k, MetacarpusL + k},
          .hip = {0.30, side * 0.068, 0.11},
          .upper = Frame::scapula,
          .lower = Frame::humerus,
          .third = {Frame::radius, Frame::metacarpus},
          .third_back_rad = 28 * leg_degree,
          .fold_rad = 65 * leg_degree,
          .stand_x = -0.01};
}

LegRig hind_leg(int k, double side) {
  return {.parts = {FemurL + k, TibiaL + k, HindHoofL + k, -1},
          .third_parts = {MetatarsusL + k, -1},
          .hip = {-0.36, side * 0.06, 0},
          .upper = Frame::femur,
          .lower = Frame::tibia,
          .third = {Frame::metatarsus, 0},
          .third_back_rad = 35 * leg_degree,
          .stand_x = -0.03};
}

// Legs in a walk of lateral sequence: a fore foot lands a quarter of a stride after the hind foot
// of its side.
std::vector<LegRig> deer_legs() {
  std::vector<LegRig> legs;
  for (int i = 0; i < 4; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    LegRig leg = i < 2 ? fore_leg(i % 2, side) : hind_leg(i % 2, side);
    leg.ankle = Frame::fetlock;
    leg.heel = Frame::hoof;
    leg.ball = leg.tip = Frame::tip;
    leg.track = side * 0.055;
    leg.stand_y = leg.track - leg.hip.y;
    leg.phase = 0.5 * (i % 2) + (i < 2 ? 0 : 0.75);
    leg.foot = {-20, {-13.4, 21.1}};  // 45 degrees back in the middle of the swing
    legs.push_back(leg);
  }
  return legs;
}

}  // namespace

FigureRig deer_rig(const AssetShape& shape) {
  constexpr double walking_neck_deg = 38, walking_head_deg = -64;
  const DeerVariant variant(shape.random);
  FigureRig rig;
  rig.parts = DeerParts;
  rig.legs = deer_legs();
  rig.joints = {{.part = Neck,
                 .parent = Torso,
                 .at = {Frame::neck_x, 0, 0.06},
                 .pitch_deg = walking_neck_deg,
                 .stand_deg = variant.neck_deg - walking_neck_deg,
                 .swing_deg = 3,
                 .harmonic = 2},
                {.part = Skull,
                 .parent = Neck,
                 .at = {Frame::neck, 0, 0},
                 .pitch_deg = walking_head_deg,
                 .stand_deg = variant.head_deg - variant.neck_deg - walking_head_deg,
                 .swing_deg = -2,
                 .harmonic = 2}};
  // Mammals at the pace that they prefer: duty factor 0.62 m^0.02, stride frequency 1.62 m^-0.15 /
  // s (Sci. Rep. 6, 28825, 2016). Horses of all sizes change to a trot at a Froude number of 0.35
  // (Griffin et al., 2004). The pace of 1 m/s and the growth of the stride, as that of persons, are
  // our own choice.
  constexpr double mass_kg = 90, withers_m = 1.14, usual_m_s = 1;
  rig.roll = {.duty = 0.62 * math::pow(mass_kg, 0.02),
              .flat = 0.05,
              .rise = 0.50,
              .push_rad = 0.75,
              .lift = 0.055};
  rig.roll.centre = rig.roll.duty / 2;
  rig.stand_height = Frame::root_z;
  rig.sway = 0.008;
  rig.root_yaw_deg = 1.5;
  rig.usual_stride = usual_m_s / (1.62 * math::pow(mass_kg, -0.15)) / withers_m;
  rig.stride_power = 0.42;
  rig.stride_s = rig.usual_stride / math::pow(usual_m_s / std::sqrt(withers_m), rig.stride_power);
  rig.most_speed = std::sqrt(0.35 * 9.81 * Frame::root_z);
  return rig;
}

Model make_deer_part(const AssetShape& shape, std::size_t part) {
  AssetBuilder builder;
  DeerShape(builder, shape).add(part);
  builder.smooth();
  return builder.take();
}

}  // namespace groundray
