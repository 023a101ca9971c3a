// Boxes of instances against the vertices of their models, moved by hand.
#include "core/tracing/instance_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "test/support/scans/solid.h"

namespace groundray::instance_box_test {
namespace {

using groundray::testing::box_model;
using groundray::testing::icosphere;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr double rounding_m = 1e-11;  // of positions within 100 m, several additions

glm::dquat random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random)));
}

glm::dvec3 random_place(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-50, 50);
  return {place(random), place(random), place(random)};
}

// Distances of points from the six faces of a box, inwards.
struct Clearance {
  double least_m = std::numeric_limits<double>::infinity();  // negative if a point is outside
  glm::dvec3 low_m{least_m}, high_m{least_m};                // of the nearest point to each face

  void add(const InstanceBox& box, const glm::dvec3& p_D) {
    const glm::dvec3 p_B = glm::conjugate(box.R_DB) * (p_D - box.p_DB);
    low_m = glm::min(low_m, p_B + 0.5 * box.size_m);
    high_m = glm::min(high_m, 0.5 * box.size_m - p_B);
    for (int k = 0; k < 3; ++k) least_m = std::min({least_m, low_m[k], high_m[k]});
  }
};

ObjectTracer tracer_of(std::vector<Model> models, std::vector<PlacedObject> placed,
                       std::vector<MovingObject> moving = {}, std::vector<Sway> sways = {}) {
  const RayDevice device;
  std::vector<ModelScene> scenes;
  for (Model& model : models) scenes.emplace_back(device, std::move(model), Tracing::Fast);
  return {device, std::move(scenes), std::move(placed), std::move(moving), std::move(sways)};
}

TEST(InstanceBox, OfAStandingObjectTouchesItsVerticesWithAllFaces) {
  std::mt19937_64 random(1);
  const Model model = icosphere(1.5, 2);
  std::vector<PlacedObject> placed;
  for (int i = 0; i < 20; ++i)
    placed.push_back({random_place(random), random_rotation(random), 0.3 + 0.2 * i, 0});
  const ObjectTracer tracer = tracer_of({model}, placed);
  const InstanceBoxes boxes(tracer);
  for (std::uint32_t i = 0; i < placed.size(); ++i) {
    const InstanceBox box = boxes.at(i + 1, milliseconds(70));
    EXPECT_EQ(box.instance, i + 1);
    EXPECT_EQ(box.velocity_m_s, glm::dvec3(0));
    Clearance clear;
    for (const auto& p_O : model.mesh.vertices_m)
      clear.add(box, placed[i].p_DO + placed[i].R_DO * (placed[i].scale * glm::dvec3(p_O)));
    EXPECT_GE(clear.least_m, -rounding_m);
    for (int k = 0; k < 3; ++k) EXPECT_LE(std::max(clear.low_m[k], clear.high_m[k]), rounding_m);
  }
}

// An object that turns while it travels: its box has its pose, and the velocity of its centre is
// the difference of two positions.
TEST(InstanceBox, OfAMovingObjectFollowsItsTrajectory) {
  std::mt19937_64 random(2);
  std::vector<Trajectory::Sample> samples;
  glm::dquat R_DO(1, 0, 0, 0);
  for (int i = 0; i <= 10; ++i) {
    samples.push_back({milliseconds(100 * i), {R_DO, {2.0 * i, 0.3 * i * i, 1}}});
    R_DO = R_DO * glm::angleAxis(0.1, glm::dvec3(0, 0, 1));
  }
  const Trajectory X_DO(samples);
  Model model = box_model({4, 2, 1});
  for (auto& vertex : model.mesh.vertices_m) vertex += glm::vec3(1, 0, 0.5);  // O is not its centre
  const ObjectTracer tracer = tracer_of({model}, {}, {{X_DO, 1.5, 0, 0}});
  const InstanceBoxes boxes(tracer);
  std::uniform_int_distribution<int> when(110, 890);
  for (int i = 0; i < 50; ++i) {
    const nanoseconds time = milliseconds(when(random));
    const InstanceBox box = boxes.at(1, time);
    const Pose X_DO_then = X_DO.pose_at(time);
    EXPECT_LT(glm::distance(box.size_m, glm::dvec3(6, 3, 1.5)), rounding_m);
    EXPECT_LT(glm::distance(box.p_DB, X_DO_then * (1.5 * glm::dvec3(1, 0, 0.5))), rounding_m);
    EXPECT_LT(
        glm::distance(box.R_DB * glm::dvec3(1, 0, 0), X_DO_then.rotation * glm::dvec3(1, 0, 0)),
        rounding_m);
    // Between poses the motion is uniform: the difference quotient over 2 us errs by its rounding,
    // 1e-14 m / 2 us, and by the curvature of the turn, (1 rad/s)^2 * 2 m * 1 us.
    constexpr nanoseconds step(1000);
    const auto [before, after] = std::pair(boxes.at(1, time - step), boxes.at(1, time + step));
    if (time % milliseconds(100) == nanoseconds(0)) continue;  // a corner of the trajectory
    const glm::dvec3 slope = (after.p_DB - before.p_DB) / 2e-6;
    EXPECT_LT(glm::distance(box.velocity_m_s, slope), 1e-5);
  }
}

TEST(InstanceBox, OfSeveralPartsContainsThemAndTouchesThemWithAllFaces) {
  std::mt19937_64 random(3);
  const auto still = [&](const glm::dvec3& p_D) {
    return Trajectory({{nanoseconds(0), {random_rotation(random), p_D}}});
  };
  const std::vector<Model> models{box_model({0.4, 0.3, 1}), box_model({0.2, 0.2, 0.8}),
                                  icosphere(0.2, 1)};
  std::vector<MovingObject> moving;
  for (std::uint32_t i = 0; i < 3; ++i) moving.push_back({still({3, 4, 0.6 * i}), 1, i, 7});
  moving.push_back({still({9, 9, 0}), 1, 0, 8});  // another instance
  const ObjectTracer tracer = tracer_of(models, {}, moving);
  const InstanceBox box = InstanceBoxes(tracer).at(1, nanoseconds(0));
  Clearance clear;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Pose X_DO = moving[i].X_DO.pose_at(nanoseconds(0));
    for (const auto& p_O : models[i].mesh.vertices_m) clear.add(box, X_DO * glm::dvec3(p_O));
  }
  EXPECT_GE(clear.least_m, -rounding_m);
  for (int k = 0; k < 3; ++k) EXPECT_LE(std::max(clear.low_m[k], clear.high_m[k]), rounding_m);
  const glm::dvec3 up = box.R_DB * glm::dvec3(0, 0, 1);
  EXPECT_LT(glm::distance(up, glm::dvec3(0, 0, 1)), rounding_m);
}

TEST(InstanceBox, OfALeaningPlantContainsItAtEachTime) {
  const Wind gale{.speed_m_s = 14, .towards = {0.6, -0.8}, .turbulence = 0.4};
  const Sway sway(gale, {.frequency_hz = 0.8, .lean_rad = 0.4});
  const Model model = testing::cylinder(0.3, 5, 12);
  const PlacedObject placed{{4, -7, 2}, glm::angleAxis(0.7, glm::dvec3(0, 0, 1)), 1.2, 0};
  const InstanceBoxes boxes(tracer_of({model}, {placed}, {}, {sway}));
  for (int i = 0; i < 100; ++i) {
    const nanoseconds time = milliseconds(137 * i);
    const InstanceBox box = boxes.at(1, time);
    const Lean lean = sway.lean({4, -7}, 1.2, std::chrono::duration<double>(time).count());
    Clearance clear;
    for (const auto& p_O : model.mesh.vertices_m)
      clear.add(box, placed.p_DO + lean.leaning(placed.R_DO * (1.2 * glm::dvec3(p_O))));
    EXPECT_GE(clear.least_m, -rounding_m);
    // The corners of the upright box lean with it: up to 0.15 of its width beyond a round stem.
    for (int k = 0; k < 3; ++k) EXPECT_LE(std::max(clear.low_m[k], clear.high_m[k]), 0.15);
  }
}

TEST(InstanceBox, ATracerOfOneInstanceHitsWhatTheWholeHitsOfIt) {
  std::mt19937_64 random(4);
  std::vector<PlacedObject> placed;
  for (std::uint32_t i = 0; i < 30; ++i)
    placed.push_back({random_place(random), random_rotation(random), 3, i % 2});
  std::vector<MovingObject> moving{
      {Trajectory({{nanoseconds(0), {{1, 0, 0, 0}, {1, 2, 3}}}}), 8, 1, 0}};
  const ObjectTracer whole = tracer_of({icosphere(2, 2), box_model({3, 2, 1})}, placed, moving);
  std::size_t hits_of_whole = 0;
  for (std::uint32_t instance = 1; instance <= 31; ++instance) {
    const ObjectTracer alone = whole.only(instance);
    EXPECT_EQ(alone.size(), 1u);
    const glm::dvec3 p_DO = whole.placed_at(instance, nanoseconds(0)).p_DO;
    std::vector<Ray> rays;
    for (int i = 0; i < 100; ++i) {
      const glm::dvec3 from = random_place(random), to = p_DO + 0.05 * random_place(random);
      rays.push_back({from, glm::normalize(to - from)});
    }
    std::vector<Hit> all(rays.size()), own(rays.size());
    whole.trace(rays, all);
    alone.trace(rays, own);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (all[i].object != instance) continue;
      ++hits_of_whole;
      EXPECT_EQ(own[i].object, 1u);
      EXPECT_EQ(own[i].range_m, all[i].range_m);
    }
  }
  EXPECT_GT(hits_of_whole, 500u);
}

}  // namespace
}  // namespace groundray::instance_box_test
