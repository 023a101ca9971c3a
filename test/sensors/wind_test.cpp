// Lidars and cameras among objects that sway in wind.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "apps/scene/readers/scene_reader.h"
#include "core/tracing/scene.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_truth.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/camera_scene.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"

namespace groundray::wind_test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

double in_seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

// A pole 20 cm wide and 4 m high whose tip sways by some metres per second.
const glm::dvec3 sides_m(0.2, 0.2, 4), foot(5, 1, -1);
const Sway& sway() {
  static const Sway of({.speed_m_s = 15, .towards = {0, 1}, .turbulence = 0.4}, {1.5, 0.5});
  return of;
}

Model pole() {
  Model box = testing::box_model(sides_m);
  for (glm::dvec3& p : box.mesh.vertices_m) p.z += sides_m.z / 2;
  return box;
}

Scene scene_of(Tracing tracing) {
  const RayDevice device;
  std::vector<ModelScene> models{{device, pole(), tracing}};
  return {RayTracer({full_resolution_level(
                        {{2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, -1000.0f)})},
                    {0, 0, 0}, tracing),
          {.label = 3},
          {},
          {device, std::move(models), {{foot}}, {}, {sway()}},
          {{10, {1}}}};
}

// The largest of |x| / half the width, |y| / half the depth and |z - middle| / half the height is 1
// on the pole's surface. A point of the leaning pole is foot + (x, y, 0) + z a, a the unit vector
// along (t, 1).
double share_of(const glm::dvec3& p_DQ, nanoseconds time) {
  const glm::dvec2 tangent = sway().lean(glm::dvec2(foot), 1, in_seconds(time)).tangent;
  const glm::dvec3 axis = glm::normalize(glm::dvec3(tangent, 1));
  const glm::dvec3 arm = p_DQ - foot;
  const double z = arm.z / axis.z;
  const glm::dvec3 p_O(arm.x - z * axis.x, arm.y - z * axis.y, z - sides_m.z / 2);
  const glm::dvec3 share = glm::abs(p_O) / (sides_m / 2.0);
  return std::max({share.x, share.y, share.z});
}

TEST(SensorsInWind, EchoesOfASwayingPoleLieOnItAtTheTimesOfTheirPulses) {
  LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vlp16.yaml");
  spec.range_noise_sigma_m = 0;
  const ScanPattern pattern(spec.pattern);
  const Trajectory X_DS({{0s, {{1, 0, 0, 0}, {0, 0, 0}}}, {2s, {{1, 0, 0, 0}, {1, -1, 0}}}});
  int echoes = 0;
  double moved = 0;
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const Scene scene = scene_of(tracing);
    for (std::int64_t sweep = 0; sweep < 10; ++sweep) {
      PulseBatch batch;
      pattern.fill(sweep, 0, pattern.pulses(sweep), batch);
      std::vector<nanoseconds> firings;
      for (const PulseBatch::Volley& volley : batch.volleys)
        firings.emplace_back(std::llround(volley.time_s * 1e9));
      const PointCloud cloud = Lidar(spec).scan(scene, X_DS, sweep, Seed{1}, 0).echoes;
      const auto x = cloud.column<double>("world_x"), y = cloud.column<double>("world_y"),
                 z = cloud.column<double>("world_z");
      const auto time_s = cloud.column<float>("time"), vy = cloud.column<float>("vy");
      for (std::size_t i = 0; i < cloud.rows(); ++i) {
        // The float's error is less than the time between two volleys.
        const auto time = *std::ranges::min_element(firings, {}, [&](nanoseconds firing) {
          return std::abs(in_seconds(firing - pattern.stamp(sweep)) - double{time_s[i]});
        });
        const glm::dvec3 p_DQ(x[i], y[i], z[i]);
        ASSERT_NEAR(share_of(p_DQ, time), 1, 1e-7) << i;
        testing::record_margin("share", share_of(p_DQ, time) - 1, 1e-7);
        moved = std::max(moved, std::abs(share_of(p_DQ, pattern.stamp(sweep)) - 1));
        const auto lean = [&](nanoseconds at) {
          return sway().lean(glm::dvec2(foot), 1, in_seconds(at));
        };
        const glm::dvec3 rest = lean(time).upright(p_DQ - foot);
        const double later_m = lean(time + 1us).leaning(rest).y;
        EXPECT_NEAR(vy[i], 1e6 * (later_m - (p_DQ.y - foot.y)), 0.01);
        ++echoes;
      }
    }
  }
  EXPECT_GT(echoes, 500);
  EXPECT_GT(moved, 1);  // within a sweep, by more than half of the pole's width
}

// Each row of a rolling shutter shows the pole at the middle of the row's exposure, and the flow
// leads to where the point is in the other image.
TEST(SensorsInWind, RowsOfACameraShowASwayingPoleAtTheirTimes) {
  const Scene scene = scene_of(Tracing::Fast);
  CameraSpec spec{.lens = Pinhole{testing::centred(120, {192, 96})}, .size_px = {192, 96}};
  spec.shutter = {.exposure_s = 0.002, .row_s = 0.004};
  const Camera camera(spec);
  const Trajectory X_DC =
      testing::gliding(testing::looking(glm::dvec3(0, 1, 0), glm::dvec3(1, 1, 0)), {});
  const Materials::InColour grey{
      {{LambertianBsdf{glm::dvec3(0.5)}}, {LambertianBsdf{glm::dvec3(0.5)}}},
      {glm::vec3(0.5f), glm::vec3(0.5f)}};
  const ImageTruth truth = image_truth(camera, scene, grey, X_DC, {.after = 100ms});
  int on = 0;
  double moved = 0;
  for (int row = 0; row < 96; ++row) {
    const nanoseconds time(4'000'000 * row + 1'000'000);
    for (int column = 0; column < 192; ++column) {
      if (truth.instance.at(column, row)[0] == 0) continue;
      const auto p = truth.p_DQ.at(column, row);
      const glm::dvec3 p_DQ(p[0], p[1], p[2]);
      ASSERT_NEAR(share_of(p_DQ, time), 1, 1e-6);
      moved = std::max(moved, std::abs(share_of(p_DQ, 1ms) - 1));
      ++on;
      // Point in the next image: iterated over the row in which it is exposed.
      const glm::dvec3 rest =
          sway().lean(glm::dvec2(foot), 1, in_seconds(time)).upright(p_DQ - foot);
      glm::dvec2 to(column, row);
      for (int step = 0; step < 50; ++step) {
        const double then_s = 0.101 + 0.004 * std::clamp(to.y, 0.0, 95.0);
        const glm::dvec3 then =
            foot + sway().lean(glm::dvec2(foot), 1, then_s).leaning(rest) - glm::dvec3(0, 1, 0);
        to = {95.5 - 120 * then.y / then.x, 47.5 - 120 * then.z / then.x};
      }
      const auto flow = truth.forward.offset_px.at(column, row);
      EXPECT_LT(glm::distance(glm::dvec2(flow[0], flow[1]), to - glm::dvec2(column, row)), 1e-5);
    }
  }
  EXPECT_GT(on, 100);
  EXPECT_GT(moved, 1);
}

}  // namespace
}  // namespace groundray::wind_test
