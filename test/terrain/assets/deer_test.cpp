#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "test/terrain/assets/walking.h"

namespace groundray::deer_test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using walking::bumps;
using walking::flat;
using walking::part_point;
using walking::slope;
using walking::straight;
using walking::walk_on;

// Numbers of parts; those of the right side follow.
constexpr std::size_t torso = 0, head = 2, humerus_l = 5, radius_l = 7, metacarpus_l = 9,
                      fore_hoof_l = 11, tibia_l = 15, metatarsus_l = 17, hind_hoof_l = 19;
constexpr double withers_m = 1.14, degree = std::numbers::pi / 180;
// In units of the height of the withers; see docs/reference/assets.md.
constexpr double scapula = 0.25, humerus = 0.20, forearm = 0.245, metacarpus = 0.215;
constexpr double femur = 0.25, tibia = 0.295, metatarsus = 0.255, fetlock = 0.085;

std::vector<Trajectory> deer_on(const HeightGrid& ground, double m_s) {
  return walk_on(ground, {.kind = AssetKind::Deer}, straight(ground, m_s));
}

glm::dvec3 place(const Trajectory& part, nanoseconds time) {
  return part.pose_at(time).translation_m;
}

// Volume that is inside of any of the closed pieces of a model, by lines along x.
double volume_m3(const Model& model) {
  constexpr double step_m = 0.025;
  double length_m = 0;
  for (double y = -0.3 + step_m / 3; y < 0.3; y += step_m) {
    for (double z = -0.1 + step_m / 3; z < 1.7; z += step_m) {
      std::vector<std::pair<double, int>> crossings;
      for (const glm::uvec3& t : model.mesh.triangles) {
        const auto& v = model.mesh.vertices_m;
        const glm::dvec2 p(y, z), a(v[t.x].y, v[t.x].z), b(v[t.y].y, v[t.y].z),
            c(v[t.z].y, v[t.z].z);
        const auto cross = [](const glm::dvec2& u, const glm::dvec2& w) {
          return u.x * w.y - u.y * w.x;
        };
        const double area = cross(b - a, c - a);
        const double wb = cross(p - a, c - a) / area, wc = cross(b - a, p - a) / area;
        if (area == 0 || wb < 0 || wc < 0 || wb + wc > 1) continue;
        crossings.emplace_back(v[t.x].x * (1 - wb - wc) + v[t.y].x * wb + v[t.z].x * wc,
                               area < 0 ? 1 : -1);  // enters where the normal points back
      }
      std::ranges::sort(crossings);
      int inside = 0;
      for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
        inside += crossings[i].second;
        if (inside > 0) length_m += crossings[i + 1].first - crossings[i].first;
      }
    }
  }
  return length_m * step_m * step_m;
}

// Red deer hinds of Scotland: 1.14 m high at the shoulder, 1.80 m long; of Britain: 63 to 120 kg.
TEST(Deer, HasThePublishedHeightLengthAndMass) {
  const Model trunk = make_figure_part({.kind = AssetKind::Deer}, torso);
  const Model skull = make_figure_part({.kind = AssetKind::Deer}, head);
  const Trajectory still({{0s, {{1, 0, 0, 0}, {0, 0, 0}}}, {1s, {{1, 0, 0, 0}, {0, 0, 0}}}});
  const auto deer = walk_on(flat(), {.kind = AssetKind::Deer}, still);
  double top_m = 0, rump_m = 0, nose_m = 0;
  for (const glm::dvec3& p : trunk.mesh.vertices_m) {
    top_m = std::max(top_m, p.z + place(deer[torso], 0s).z);
    rump_m = std::max(rump_m, -p.x);
  }
  for (const glm::dvec3& p : skull.mesh.vertices_m) nose_m = std::max(nose_m, p.x);
  EXPECT_NEAR(top_m, 1.14, 0.01);
  const double neck_m = glm::distance(place(deer[1], 0s), place(deer[head], 0s));
  EXPECT_NEAR(rump_m + place(deer[1], 0s).x + neck_m + nose_m, 1.80, 0.05);
  const double kg = 1000 * volume_m3(make_asset({.kind = AssetKind::Deer}));  // as dense as water
  EXPECT_GT(kg, 63);
  EXPECT_LT(kg, 120);
}

TEST(Deer, BonesAreJoinedAndKeepTheirLengths) {
  struct Bone {
    std::size_t from, to;
    double length;
  };
  const std::array<Bone, 6> bones = {{{3, humerus_l, scapula},
                                      {humerus_l, radius_l, humerus},
                                      {radius_l, metacarpus_l, forearm},
                                      {metacarpus_l, fore_hoof_l, metacarpus},
                                      {13, tibia_l, femur},
                                      {metatarsus_l, hind_hoof_l, metatarsus}}};
  for (const HeightGrid& ground : {flat(), slope(0.2), bumps()}) {
    for (const double m_s : {0.5, 1.0, 1.7}) {
      const auto deer = deer_on(ground, m_s);
      for (nanoseconds time = 0s; time <= 5s; time += 5ms) {
        for (std::size_t side = 0; side < 2; ++side) {
          for (const Bone& bone : bones) {
            EXPECT_NEAR(glm::distance(place(deer[bone.from + side], time),
                                      place(deer[bone.to + side], time)),
                        bone.length * withers_m, 1e-5);
          }
          EXPECT_NEAR(glm::distance(place(deer[tibia_l + side], time),
                                    place(deer[metatarsus_l + side], time)),
                      tibia * withers_m, 1e-5);
        }
      }
    }
  }
}

// Times at which a hoof lands and leaves, found by the speed of its tip.
std::vector<std::pair<double, double>> stances(const Trajectory& hoof) {
  std::vector<std::pair<double, double>> found;
  bool stood = true;
  for (nanoseconds time = 500us; time < 5s; time += 1ms) {
    const glm::dvec3 tip = withers_m * glm::dvec3(0.085, 0, -0.085);
    const bool stands = part_point(hoof, tip, time).m_s < 0.04;
    const double s = std::chrono::duration<double>(time).count();
    if (stands && !stood) found.emplace_back(s, 0);
    if (!stands && stood && !found.empty()) found.back().second = s;
    stood = stands;
  }
  return found;
}

// A walk of lateral sequence: left hind, left fore, right hind, right fore, a quarter of a stride
// apart (Hildebrand). Duty factor and frequency of strides: Sci. Rep. 6, 28825 (2016), for 90 kg.
TEST(Deer, FeetFallInALateralSequence) {
  const auto deer = deer_on(flat(), 1);
  const auto hind = stances(deer[hind_hoof_l]);
  const double stride_s = hind[1].first - hind[0].first;
  EXPECT_NEAR(1 / stride_s, 1.62 * std::pow(90, -0.15), 0.005);
  const std::array<std::pair<std::size_t, double>, 4> feet = {
      {{hind_hoof_l, 0}, {fore_hoof_l, 0.25}, {hind_hoof_l + 1, 0.5}, {fore_hoof_l + 1, 0.75}}};
  for (const auto& [hoof, phase] : feet) {
    const auto of_hoof = stances(deer[hoof]);
    const double off = std::remainder((of_hoof[0].first - hind[0].first) / stride_s - phase, 1);
    EXPECT_NEAR(off, 0, 0.01) << hoof;
    EXPECT_NEAR((of_hoof[0].second - of_hoof[0].first) / stride_s, 0.62 * std::pow(90, 0.02), 0.02);
  }
}

// Fetlock of the left fore leg: in a stance it does not move; in the second part of a swing it is
// on a cubic curve below the hip, which leaves and arrives as fast as the ground. One footprint is
// measured; all others follow from it.
TEST(Deer, FetlocksFollowTheClosedFormOfTheWalk) {
  constexpr double m_s = 0.6, hip_x = 0.30, hip_y = 0.068, hip_z = 0.11, ahead = -0.01;
  const double duty = 0.62 * std::pow(90, 0.02);
  const double stride_m = std::pow(0.6, 0.42) / (1.62 * std::pow(90, -0.15));
  const double size = std::pow(0.6, 0.42);  // of the swing
  const auto deer = deer_on(flat(), m_s);
  const double landed_s = stances(deer[fore_hoof_l])[0].first;
  const double print_m = place(deer[fore_hoof_l], nanoseconds(long(1e9 * (landed_s + 0.3)))).x;
  int standing = 0, swinging = 0;
  for (nanoseconds time = 2s; time < 5s; time += 15ms) {
    const double x = -20 + m_s * std::chrono::duration<double>(time).count();
    const double strides = (x - (print_m - (hip_x + ahead) * withers_m)) / stride_m + duty / 2;
    const double phase = strides - std::floor(strides);
    const glm::dvec3 p = place(deer[fore_hoof_l], time);
    const glm::dvec3 hip =
        deer[torso].pose_at(time) * (withers_m * glm::dvec3(hip_x, hip_y, hip_z));
    if (phase < 0.49) {
      EXPECT_NEAR(p.x, print_m + std::floor(strides) * stride_m, 1e-3);
      EXPECT_NEAR(p.z, fetlock * withers_m, 1e-6);
      EXPECT_NEAR(hip.z, (0.79 + hip_z) * withers_m, 2e-3);
      ++standing;
    } else if (phase > duty + 0.46 * (1 - duty) && phase < 0.999) {
      const double u = (phase - duty) / (1 - duty);
      // De Casteljau's algorithm, on the positions ahead of the hip.
      std::array<double, 4> b = {-duty / 2, -duty / 2 - (1 - duty) / 3, duty / 2 + (1 - duty) / 3,
                                 duty / 2};
      for (std::size_t n = 3; n > 0; --n) {
        for (std::size_t i = 0; i < n; ++i) b[i] = std::lerp(b[i], b[i + 1], u);
      }
      EXPECT_NEAR(p.x - hip.x, ahead * withers_m + b[0] * stride_m, 4e-3);
      const double lift_m = 0.055 * size * withers_m * std::pow(4 * u * (1 - u), 2);
      EXPECT_NEAR(p.z - hip.z, (fetlock - 0.79 - hip_z) * withers_m + lift_m, 4e-3);
      ++swinging;
    }
  }
  EXPECT_GT(standing, 50);
  EXPECT_GT(swinging, 15);
}

// The scapula turns as the forearm does, 28 degrees ahead of it. Given hip and fetlock, the
// shoulder is then found by bisection.
TEST(Deer, JointsOfAStandingLegAreWhereItsBonesMeet) {
  const auto deer = deer_on(flat(), 1);
  int tried = 0;
  for (nanoseconds time = 1s; time < 5s; time += 35ms) {
    const glm::dvec3 fetlock_m = place(deer[fore_hoof_l], time);
    if (part_point(deer[fore_hoof_l], glm::dvec3(0), time).m_s > 0.02) continue;
    const glm::dvec3 hip = place(deer[3], time), down = glm::normalize(fetlock_m - hip);
    const glm::dvec3 x = deer[torso].pose_at(time).rotation * glm::dvec3(1, 0, 0);
    const glm::dvec3 forward = glm::normalize(x - down * glm::dot(x, down));
    const auto hangs = [&](double length, double angle_rad) {
      return withers_m * length * (forward * std::sin(angle_rad) + down * std::cos(angle_rad));
    };
    const auto joints = [&](double angle_rad) {
      return std::pair(hip + hangs(scapula, angle_rad),
                       fetlock_m - hangs(forearm + metacarpus, angle_rad - 28 * degree));
    };
    double low = 20 * degree,
           high = 90 * degree;  // of the scapula: the humerus too short, too long
    for (int i = 0; i < 60; ++i) {
      const double angle = (low + high) / 2;
      const auto [shoulder, elbow] = joints(angle);
      (glm::distance(shoulder, elbow) < humerus * withers_m ? low : high) = angle;
    }
    const auto [shoulder, elbow] = joints(low);
    EXPECT_LT(glm::distance(shoulder, place(deer[humerus_l], time)), 1e-5);
    EXPECT_LT(glm::distance(elbow, place(deer[radius_l], time)), 1e-5);
    ++tried;
  }
  EXPECT_GT(tried, 40);
}

TEST(Deer, VariantsStandInThreeBearingsAndFourCoats) {
  std::set<int> heights_cm;
  std::set<float> coats;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Model deer = make_asset({.kind = AssetKind::Deer, .seed = {seed}});
    double top_m = 0;
    for (const glm::dvec3& p : deer.mesh.vertices_m) top_m = std::max(top_m, p.z);
    heights_cm.insert(static_cast<int>(std::floor(20 * top_m)) * 5);
    coats.insert(deer.surfaces[0].color.r);
  }
  EXPECT_EQ(heights_cm.size(), 3u);
  EXPECT_EQ(coats.size(), 4u);
}

}  // namespace
}  // namespace groundray::deer_test
