// Lidars among static and moving objects, and the contributions of each to an echo.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "apps/scene/readers/scene_reader.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::lidar_objects_test {
namespace {

using namespace std::chrono_literals;
using std::numbers::pi;
using testing::box_model;

HeightGrid ground_at(float height_m) {
  return {{2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, height_m)};
}

Material grey(const char* name, double reflectance) {
  return {name, Lambertian{{{300, reflectance}, {2500, reflectance}}}};
}

// Ground of material 0 and label 3; one object per model, with labels 10, 11, ... and materials 1,
// 2, ...
Scene scene_of(Tracing tracing, const std::vector<Model>& models, std::vector<PlacedObject> placed,
               std::vector<MovingObject> moving, Materials materials = {}, float ground_m = -1000) {
  const RayDevice device;
  std::vector<ModelScene> scenes;
  std::vector<ModelTruth> truths;
  for (const Model& model : models) {
    const auto number = static_cast<std::uint16_t>(scenes.size());
    scenes.emplace_back(device, model, tracing);
    truths.push_back(
        {static_cast<std::uint16_t>(10 + number), {static_cast<std::uint16_t>(1 + number)}});
  }
  return {RayTracer({full_resolution_level(ground_at(ground_m))}, {0, 0, 0}, tracing),
          {.label = 3},
          std::move(materials),
          {device, std::move(scenes), std::move(placed), std::move(moving)},
          std::move(truths)};
}

LidarSpec vlp16() {
  LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vlp16.yaml");
  spec.range_noise_sigma_m = 0;
  return spec;
}

// Exact firing time of a pulse from the column `time`. The float's error is less than a firing's
// period, 2.3 us and more, so the time identifies the pulse.
std::chrono::nanoseconds time_of(const std::vector<std::chrono::nanoseconds>& firings,
                                 std::chrono::nanoseconds stamp, float time_s) {
  return *std::ranges::min_element(firings, {}, [&](std::chrono::nanoseconds firing) {
    return std::abs(std::chrono::duration<double>(firing - stamp).count() - double{time_s});
  });
}

TEST(LidarObjects, EchoesOfAMovingBoxLieOnItAtTheTimesOfTheirPulses) {
  const glm::dvec3 sides_m(2, 1.5, 1);
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 12; ++k) {
    const double angle = 0.3 * k;
    samples.push_back({50ms * k,
                       {rotation_from_yaw_pitch_roll(angle, 0.2 * angle, -0.1 * angle),
                        {6 * std::cos(angle), 6 * std::sin(angle), 0.2 * std::sin(3 * angle)}}});
  }
  const Trajectory X_DO(samples);
  const Trajectory X_DS({{0s, {{1, 0, 0, 0}, {0, 0, 0}}}, {1s, {{1, 0, 0, 0}, {2, -1, 0}}}});
  const LidarSpec spec = vlp16();
  const ScanPattern pattern(spec.pattern);
  int echoes = 0;
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const Scene scene = scene_of(tracing, {box_model(sides_m)}, {}, {{X_DO, 1, 0}});
    for (std::int64_t sweep = 0; sweep < 5; ++sweep) {
      PulseBatch batch;
      pattern.fill(sweep, 0, pattern.pulses(sweep), batch);
      std::vector<std::chrono::nanoseconds> firings;
      for (const PulseBatch::Volley& volley : batch.volleys)
        firings.emplace_back(std::llround(volley.time_s * 1e9));
      const PointCloud cloud = Lidar(spec).scan(scene, X_DS, sweep, Seed{1}, 0).echoes;
      const auto x = cloud.column<double>("world_x"), y = cloud.column<double>("world_y"),
                 z = cloud.column<double>("world_z");
      const auto time_s = cloud.column<float>("time");
      const auto label = cloud.column<std::uint16_t>("label");
      const auto vx = cloud.column<float>("vx");
      for (std::size_t i = 0; i < cloud.rows(); ++i) {
        ASSERT_EQ(label[i], 10);
        const auto time = time_of(firings, pattern.stamp(sweep), time_s[i]);
        const glm::dvec3 p_DQ(x[i], y[i], z[i]);
        const glm::dvec3 p_OQ = inverse(X_DO.pose_at(time)) * p_DQ;
        const glm::dvec3 share = glm::abs(p_OQ) / (sides_m / 2.0);
        ASSERT_NEAR(std::max({share.x, share.y, share.z}), 1, 1e-8) << i;
        const glm::dvec3 later = X_DO.pose_at(time + 1us) * p_OQ;
        EXPECT_NEAR(vx[i], 1e6 * (later.x - p_DQ.x), 0.01);
        ++echoes;
      }
    }
  }
  EXPECT_GT(echoes, 2000);
}

LidarSpec down(double divergence_rad, int sub_rays) {
  LidarSpec spec;
  spec.model = "test";
  spec.pattern = TablePattern{.period_s = 1, .shots = {{.elevation_rad = -pi / 2}}};
  spec.gate = {0.1, 2000};
  spec.beam.divergence_rad = glm::dvec2(divergence_rad);
  spec.beam.sub_rays = sub_rays;
  spec.beam.most_sub_rays = sub_rays;
  spec.light.emplace();
  spec.light->wavelength_nm = 905;
  spec.light->optics = {.pulse_energy_j = 1e-7, .aperture_diameter_m = 0.025};
  spec.light->pulse = {.fwhm_s = 5e-9};
  spec.light->receiver.timing = ReceiverSpec::Timing::CentreOfGravity;
  spec.light->receiver.threshold_w = 1e-12;
  spec.light->receiver.returns = ReceiverSpec::Returns::All;
  return spec;
}

const Trajectory& hovering() {
  static const Trajectory X_DS(
      {{0s, {{1, 0, 0, 0}, {0, 0, 20}}}, {2s, {{1, 0, 0, 0}, {0, 0, 20}}}});
  return X_DS;
}

// A plate 0.1 mm thick on the ground, with its edge on a line through the beam's axis: half of the
// light falls on each, and each returns light in proportion to its reflectance.
TEST(LidarObjects, EchoOfTwoSurfacesReportsBothAndTheirShares) {
  const Scene scene = scene_of(Tracing::Fast, {box_model({10, 10, 1e-4})}, {{{5, 0, 0}}}, {},
                               {grey("ground", 0.2), grey("plate", 0.6)}, 0);
  const PointCloud echoes = Lidar(down(3e-3, 64)).scan(scene, hovering(), 0, Seed{1}, 0).echoes;
  ASSERT_EQ(echoes.rows(), 1u);
  EXPECT_EQ(echoes.column<std::uint16_t>("label")[0], 10);
  EXPECT_EQ(echoes.column<std::uint32_t>("instance")[0], 1u);
  EXPECT_EQ(echoes.column<std::uint16_t>("second_label")[0], 3);
  // One of the 64 sub-rays may lie on the line: its light goes to one side. The plate's fraction
  // changes by 0.2 x 0.6 / 0.4^2 of that.
  EXPECT_NEAR(echoes.column<float>("share")[0], 0.75, 0.75 / 64 + 1e-4);
  EXPECT_NEAR(echoes.column<float>("second_share")[0], 0.25, 0.75 / 64 + 1e-4);
}

TEST(LidarObjects, EachObjectReflectsByItsMaterial) {
  const auto amplitude_of = [](double reflectance) {
    const Scene scene = scene_of(Tracing::Fast, {box_model({10, 10, 2})}, {{{0, 0, 5}}}, {},
                                 {grey("ground", 0.9), grey("box", reflectance)}, 0);
    const PointCloud echoes = Lidar(down(1e-3, 16)).scan(scene, hovering(), 0, Seed{1}, 0).echoes;
    EXPECT_EQ(echoes.rows(), 1u);
    EXPECT_NEAR(echoes.column<double>("range_true")[0], 14, 1e-5);
    return double{echoes.column<float>("amplitude")[0]};
  };
  EXPECT_NEAR(amplitude_of(0.8) / amplitude_of(0.2), 4, 1e-5);
}

// Objects are exact, and at full resolution the ground is too: the bound is the accuracy of ranges.
TEST(LidarObjects, ObjectsOnGroundAtFullResolutionHaveNoErrorButTheRanges) {
  LidarSpec spec = vlp16();
  spec.error_bound = LidarSpec::ErrorBound::Report;
  const Scene scene = scene_of(Tracing::Fast, {box_model({1, 1, 1})}, {{{5, 0, 0.5}}}, {}, {}, 0);
  const Trajectory X_DS({{0s, {{1, 0, 0, 0}, {0, 0, 1}}}, {1s, {{1, 0, 0, 0}, {0, 0, 1}}}});
  const PointCloud cloud = Lidar(spec).scan(scene, X_DS, 0, Seed{1}, 0).echoes;
  const auto instance = cloud.column<std::uint32_t>("instance");
  EXPECT_GT(std::ranges::count(instance, 1u), 100);
  EXPECT_GT(std::ranges::count(instance, 0u), 1000);
  const auto range_m = cloud.column<double>("range_true");
  const auto bound_m = cloud.column<float>("error_bound");
  for (std::size_t i = 0; i < cloud.rows(); ++i) {
    const double accuracy_m = 1e-9 * range_m[i] + 1e-9;
    EXPECT_GE(double{bound_m[i]}, accuracy_m * (1 - 1e-7));
    EXPECT_LE(double{bound_m[i]}, 2 * accuracy_m);
  }
}

}  // namespace
}  // namespace groundray::lidar_objects_test
