#include "test/terrain/assets/walking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/tracing/object_tracer.h"

namespace groundray::walking_test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using ::testing::HasSubstr;
using walking::flat;
using walking::hit_by_hand_m;
using walking::part_point;
using walking::PartPoint;
using walking::slope;
using walking::straight;
using walking::walk_on;

// A point of the sole on which a foot turns, in units of the figure's size: the ball of a foot, the
// tip of a hoof.
struct Sole {
  std::size_t part;
  glm::dvec3 at;
  double bone;  // length of the bone above the foot, two parts before it
};
struct Kind {
  AssetSpec asset;
  double size_m, speed_m_s, duty;  // duty: of the point of the sole
  std::vector<Sole> soles;
};
std::vector<Kind> kinds() {
  constexpr glm::dvec3 ball(0.072, 0, -0.039), tip(0.085, 0, -0.085);
  return {{{.kind = AssetKind::Person}, 1.75, 1.3, 0.38, {{11, ball, 0.246}, {12, ball, 0.246}}},
          {{.kind = AssetKind::Deer},
           1.14,
           1.0,
           0.62 * std::pow(90, 0.02),
           {{11, tip, 0.215}, {12, tip, 0.215}, {19, tip, 0.255}, {20, tip, 0.255}}}};
}

// Points at which a sole stands, each with the time for which it does.
struct Stand {
  std::vector<glm::dvec3> points;
  nanoseconds begin, end;
};
std::vector<Stand> stands_of(const Trajectory& part, const glm::dvec3& p_P) {
  std::vector<Stand> stands;
  bool stood = false;
  for (nanoseconds time = 2500us; time < 5s; time += 5ms) {
    const PartPoint point = part_point(part, p_P, time);
    const bool is_still = point.m_s < 0.04;
    if (is_still && !stood) stands.push_back({{}, time, time});
    if (is_still) stands.back().points.push_back(point.p), stands.back().end = time;
    stood = is_still;
  }
  if (stood) stands.pop_back();                                      // the last and the first
  if (stands.front().begin == 2500us) stands.erase(stands.begin());  // may be incomplete
  std::erase_if(stands, [](const Stand& stand) { return stand.points.size() < 12; });
  return stands;
}

TEST(Walking, AStandingFootStaysWithinTwoMillimetresOfOnePoint) {
  for (const Kind& kind : kinds()) {
    for (const double rise : {0.0, 0.15, -0.15}) {
      const HeightGrid grid = slope(rise);
      const auto figure = walk_on(grid, kind.asset, straight(grid, kind.speed_m_s));
      for (const Sole& sole : kind.soles) {
        const auto stands = stands_of(figure[sole.part], kind.size_m * sole.at);
        ASSERT_GT(stands.size(), 2u);
        for (const Stand& stand : stands) {
          double most_m = 0;
          for (const glm::dvec3& p : stand.points) {
            most_m = std::max(most_m, glm::distance(p, stand.points.front()));
            EXPECT_NEAR(p.z, p.x * rise, 2e-3);
          }
          EXPECT_LT(most_m, 2e-3);
        }
        const std::chrono::duration<double> stride = stands[1].begin - stands[0].begin;
        const double share = (stands[1].end - stands[1].begin) / stride;
        EXPECT_NEAR(share, kind.duty, 0.05) << asset_name(kind.asset.kind) << " on " << rise;
      }
    }
  }
}

double stride_m(const Kind& kind, const HeightGrid& grid, double m_s) {
  const auto figure = walk_on(grid, kind.asset, straight(grid, m_s));
  const auto stands = stands_of(figure[kind.soles[0].part], kind.size_m * kind.soles[0].at);
  return stands[1].points[5].x - stands[0].points[5].x;
}

TEST(Walking, StridesGrowWithSpeedAndAreShorterOnSlopes) {
  for (const Kind& kind : kinds()) {
    const double usual_m = stride_m(kind, flat(), kind.speed_m_s);
    EXPECT_NEAR(stride_m(kind, flat(), 0.7 * kind.speed_m_s) / usual_m, std::pow(0.7, 0.42), 0.004);
    for (const double rise : {0.2, -0.2}) {
      EXPECT_NEAR(stride_m(kind, slope(rise), kind.speed_m_s) / usual_m,
                  1 / (1 + (rise / 0.5) * (rise / 0.5)), 0.004);
    }
  }
}

TEST(Walking, APathWithoutLengthIsStoodOn) {
  for (const Kind& kind : kinds()) {
    const double c = std::sqrt(0.5);  // a heading of 90 degrees
    const Trajectory still({{0s, {{c, 0, 0, c}, {3, 4, 0}}}, {2s, {{c, 0, 0, c}, {3, 4, 0}}}});
    const auto figure = walk_on(slope(), kind.asset, still);
    double low_m = 1e9;
    for (std::size_t part = 0; part < figure.size(); ++part) {
      EXPECT_EQ(figure[part].pose_at(0s).translation_m, figure[part].pose_at(2s).translation_m);
      const Model model = make_figure_part(kind.asset, part);
      for (const glm::dvec3& p : model.mesh.vertices_m)
        low_m = std::min(low_m, (figure[part].pose_at(1s) * p).z);
    }
    EXPECT_NEAR(low_m, 3.0 / 8, 3e-3);
    const glm::dvec3 ahead = figure[0].pose_at(1s).rotation * glm::dvec3(1, 0, 0);
    EXPECT_NEAR(ahead.y, 1, 1e-12);
  }
}

TEST(Walking, PosesOutsideTheIntervalAreLeftOut) {
  const Trajectory path({{0s, {{1, 0, 0, 0}, {-8, 0, 0}}}, {16s, {{1, 0, 0, 0}, {8, 0, 0}}}});
  const auto ground = [](const glm::dvec2&) { return std::optional<double>(0); };
  const WalkSpec all{.asset = {.kind = AssetKind::Person}};
  WalkSpec some = all;
  some.from = 4s;
  some.until = 5s;
  const auto whole = walk(ground, all, path), part = walk(ground, some, path);
  ASSERT_EQ(whole.size(), part.size());
  for (std::size_t i = 0; i < part.size(); ++i) {
    EXPECT_EQ(part[i].begin_time(), 4s);
    EXPECT_EQ(part[i].end_time(), 5s);
    EXPECT_EQ(part[i].pose_at(4500ms).translation_m, whole[i].pose_at(4500ms).translation_m);
  }
}

// Wherever a path pauses, all feet stand on the ground a third of a second later.
TEST(Walking, FeetStandWhileAPathPauses) {
  for (const Kind& kind : kinds()) {
    for (const double walked_m : {2.0, 2.17, 2.41, 2.63, 2.85, 3.02}) {
      const auto walked = nanoseconds(std::llround(1e9 * walked_m / kind.speed_m_s));
      const auto at = [](double x) { return Pose{{1, 0, 0, 0}, {x, 1, x / 8}}; };
      const Trajectory path({{0s, at(0)},
                             {walked, at(walked_m)},
                             {walked + 1s, at(walked_m)},
                             {2 * walked + 1s, at(2 * walked_m)}});
      const auto figure = walk_on(slope(), kind.asset, path);
      for (const Sole& sole : kind.soles) {
        double lowest_m = 1e9;  // of the foot and its toes
        for (const std::size_t part : {sole.part, sole.part + 2}) {
          if (part != sole.part && kind.soles.size() > 2) continue;
          const Pose pose = figure[part].pose_at(walked + 500ms);
          EXPECT_EQ(figure[part].pose_at(walked + 350ms).translation_m, pose.translation_m);
          const Model model = make_figure_part(kind.asset, part);
          for (const glm::dvec3& p_P : model.mesh.vertices_m) {
            const glm::dvec3 p = pose * p_P;
            lowest_m = std::min(lowest_m, p.z - p.x / 8);
          }
        }
        const auto place = [&](std::size_t part) {
          return figure[part].pose_at(walked + 500ms).translation_m;
        };
        EXPECT_NEAR(glm::distance(place(sole.part - 2), place(sole.part)), sole.bone * kind.size_m,
                    1e-3);
        EXPECT_NEAR(lowest_m, 0, 6e-3) << walked_m << " m, part " << sole.part;
      }
    }
  }
}

TEST(Walking, VariantsDifferInPhase) {
  for (const Kind& kind : kinds()) {
    const Trajectory path = straight(flat(), kind.speed_m_s);
    AssetSpec other = kind.asset;
    other.seed = {5};
    const auto a = walk_on(flat(), kind.asset, path), b = walk_on(flat(), other, path);
    const std::size_t foot = kind.soles[0].part;
    EXPECT_GT(glm::distance(a[foot].pose_at(2s).translation_m, b[foot].pose_at(2s).translation_m),
              0.02);
  }
}

// Rays of many times meet each part where the gait, evaluated 20 times as densely as the poses of
// the tracer, has it at the ray's own time.
TEST(Walking, EachRayMeetsTheLimbsAtItsOwnTime) {
  for (const Kind& kind : kinds()) {
    const auto usual = walk_on(flat(), kind.asset, straight(flat(), kind.speed_m_s));
    const auto fine = walk_on(flat(), kind.asset, straight(flat(), kind.speed_m_s), 250us);
    const RayDevice device;
    std::vector<Model> models;
    std::vector<ModelScene> scenes;
    std::vector<MovingObject> moving;
    for (std::uint32_t part = 0; part < usual.size(); ++part) {
      models.push_back(make_figure_part(kind.asset, part));
      scenes.emplace_back(device, models.back(), Tracing::Exact);
      moving.push_back({usual[part], 1, part, 7});
    }
    const ObjectTracer tracer(device, scenes, {}, moving);
    std::vector<Ray> rays;
    for (int i = 0; i < 800; ++i) {
      const nanoseconds time = 1s + i * 2'085'000ns;
      const double x = usual[0].pose_at(time).translation_m.x;
      const glm::dvec3 to(x + 0.5 * std::sin(i * 0.7), 1, 0.05 + 1.1 * std::fmod(i * 0.618, 1.0));
      const glm::dvec3 from(x + 1, -4, 1.2);
      rays.push_back({from, glm::normalize(to - from), 20, time});
    }
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits);
    int met = 0, limbs = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      double by_hand_m = std::numeric_limits<double>::infinity();
      for (std::size_t part = 0; part < models.size(); ++part) {
        by_hand_m = std::min(
            by_hand_m, hit_by_hand_m(models[part], fine[part].pose_at(rays[i].time), rays[i]));
      }
      if (!hits[i] || std::isinf(by_hand_m)) continue;
      const double cosine = std::abs(glm::dot(rays[i].direction, glm::dvec3(hits[i].normal)));
      if (cosine < 0.3) continue;  // near an outline a shift of 2 mm may hit another limb
      ++met;
      if (hits[i].object > 5) ++limbs;
      EXPECT_EQ(tracer.instance_of(hits[i].object), 1u);
      EXPECT_NEAR(hits[i].range_m, by_hand_m, 2e-3 / cosine) << i;
      EXPECT_EQ(tracer.part_at(1, rays[i].origin + rays[i].direction * hits[i].range_m,
                               glm::dvec3(hits[i].normal), rays[i].time),
                hits[i].object);
    }
    EXPECT_GT(met, 150);
    EXPECT_GT(limbs, 40);
  }
}

TEST(Walking, RejectsWhatCannotWalk) {
  const auto message_of = [](const AssetSpec& asset, const Trajectory& path) -> std::string {
    try {
      const HeightGrid ground = flat();
      const Ground surface(ground);
      walk([&](const glm::dvec2& p) { return surface.height_m_at(p); }, {.asset = asset}, path);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message_of({.kind = AssetKind::Rock}, straight(flat(), 1)),
              HasSubstr("a rock does not walk"));
  EXPECT_THAT(
      message_of({.kind = AssetKind::Person}, straight(flat(), 4)),
      HasSubstr("a person of this size walks at up to 2.13 m/s, but the path has 4.00 m/s"));
  EXPECT_THAT(
      message_of({.kind = AssetKind::Person},
                 Trajectory({{0s, {{1, 0, 0, 0}, {24, 0, 0}}}, {2s, {{1, 0, 0, 0}, {27, 0, 0}}}})),
      HasSubstr("a foot of the person would stand outside the DEM or in a hole"));
  EXPECT_THAT(message_of({.kind = AssetKind::Deer}, straight(flat(), 2)),
              HasSubstr("a deer of this size walks at up to 1.76 m/s, but the path has 2.00 m/s"));
  EXPECT_THAT(message_of({.kind = AssetKind::Deer, .size_m = 0}, straight(flat(), 1)),
              HasSubstr("size_m = 0 must be from 0.001"));
  EXPECT_THROW(walk_on(flat(), {.kind = AssetKind::Deer}, straight(flat(), 1), 0ns), Error);
}

}  // namespace
}  // namespace groundray::walking_test
