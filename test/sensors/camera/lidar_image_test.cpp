#include "sensors/camera/lidar_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::lidar_image_test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using testing::box_model;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Axes of a camera that looks along x of D.
const glm::dquat R_DC(0.5, -0.5, 0.5, -0.5);
const glm::dvec3 sides_m(2, 3, 2);
constexpr double focal_px = 300;
constexpr glm::ivec2 size_px{320, 240};
constexpr glm::dvec2 centre_px{160, 120};

// Flat ground at height 0, and boxes.
Scene scene_of(Tracing tracing, std::vector<PlacedObject> placed,
               std::vector<MovingObject> moving) {
  const RayDevice device;
  const HeightGrid ground({2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, 0));
  return {RayTracer({full_resolution_level(ground)}, {0, 0, 0}, tracing),
          {.label = 1},
          {},
          {device,
           {ModelScene(device, box_model(sides_m), tracing)},
           std::move(placed),
           std::move(moving)},
          {{2, {1}}}};
}

Camera pinhole(const ShutterSpec& shutter) {
  CameraSpec spec;
  spec.lens = Pinhole{{{focal_px, focal_px}, centre_px, 0}};
  spec.size_px = size_px;
  spec.shutter = shutter;
  return Camera(spec);
}

Trajectory path(const Pose& begin, const glm::dvec3& velocity_m_s) {
  return Trajectory({{0s, begin}, {1s, {begin.rotation, begin.translation_m + velocity_m_s}}});
}

LidarSpec vlp16() {
  LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vlp16.yaml");
  spec.range_noise_sigma_m = 0;
  return spec;
}

// Returns true if the segment between two points intersects a box centred at the origin.
bool passes(const glm::dvec3& from, const glm::dvec3& to) {
  double enter = 0, leave = 1;
  for (int k = 0; k < 3; ++k) {
    const double a = (-sides_m[k] / 2 - from[k]) / (to[k] - from[k]);
    const double b = (sides_m[k] / 2 - from[k]) / (to[k] - from[k]);
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave;
}

// The camera is a metre beside the lidar, so that the box hides from it points that the lidar sees,
// and it looks along the ground.
TEST(LidarImage, ProjectsEchoesThroughAPinholeUnlessOccluded) {
  const glm::dvec3 p_DO(12, 0.5, 1), p_DC(0.3, -1, 0.4);
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const Scene scene = scene_of(tracing, {{.p_DO = p_DO}}, {});
    const Trajectory X_DS = path({{1, 0, 0, 0}, {0, 0, 2}}, {0, 0, 0});
    const LidarScan scan = Lidar(vlp16()).scan(scene, X_DS, 0, Seed{1}, 0);
    const auto x = scan.echoes.column<double>("world_x"), y = scan.echoes.column<double>("world_y"),
               z = scan.echoes.column<double>("world_z");
    const auto imaged = image_echoes(pinhole({0.005, 0}), scene, path({R_DC, p_DC}, {0, 0, 0}),
                                     300ms, scan.echoes, 0s);
    std::size_t ahead = 0, visible = 0, hidden = 0;
    for (const double x_D : x) ahead += x_D > p_DC.x;
    EXPECT_EQ(imaged.size(), ahead);
    for (const ImagedEcho& echo : imaged) {
      const glm::dvec3 p_DQ(x[echo.echo], y[echo.echo], z[echo.echo]), way = p_DQ - p_DC;
      const double u = centre_px.x - focal_px * way.y / way.x;
      const double v = centre_px.y - focal_px * way.z / way.x;
      // A few roundings of pixels of at most 1e4 near the image.
      if (std::max(std::abs(u), std::abs(v)) < 1e4) {
        EXPECT_NEAR(echo.u_px, u, 1e-9);
        EXPECT_NEAR(echo.v_px, v, 1e-9);
        testing::record_margin("pixel", std::max(std::abs(echo.u_px - u), std::abs(echo.v_px - v)),
                               1e-9, "px");
      }
      EXPECT_NEAR(echo.depth_m, way.x, 1e-12);
      const bool is_inside = -0.5 <= u && u < 319.5 && -0.5 <= v && v < 239.5;
      EXPECT_EQ(echo.is_inside, is_inside);
      // The box's own points lie on its surface: the segment ends up to ten micrometres before
      // them.
      const double share = 1 - 1e-5 / glm::length(way);
      const bool is_visible = is_inside && !passes(p_DC - p_DO, p_DC + way * share - p_DO);
      EXPECT_EQ(echo.is_visible, is_visible) << u << ' ' << v << ' ' << way.x;
      visible += echo.is_visible;
      hidden += echo.is_inside && !echo.is_visible;
    }
    EXPECT_GT(visible, 1000u);
    EXPECT_GT(hidden, 20u);
  }
}

// The lidar's first hit is also the first hit of a camera at the lidar's position, at any
// incidence.
TEST(LidarImage, EveryEchoIsVisibleToACameraAtTheLidar) {
  const HeightGrid ground = testing::fractal(257, 1, 40, Seed{3});
  const glm::dvec3 p_DS(3.3, -7.1, ground.height_m_at({3.3, -7.1}).value() + 0.6);
  LidarSpec flash;
  flash.model = "test";
  flash.pattern = raster_pattern({60, 300, 6.2, 1.2}, 0, 0, 0.1);
  flash.gate = {0, 1000};
  CameraSpec spec;
  spec.size_px = {720, 360};
  spec.lens = Equirectangular{spec.size_px};
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const Scene scene{RayTracer({full_resolution_level(ground)}, {0, 0, 0}, tracing), {.label = 1}};
    const auto echoes =
        Lidar(flash).scan(scene, path({{1, 0, 0, 0}, p_DS}, {0, 0, 0}), 0, Seed{1}, 0).echoes;
    const auto imaged =
        image_echoes(Camera(spec), scene, path({R_DC, p_DS}, {0, 0, 0}), 0s, echoes, 0s);
    ASSERT_GT(echoes.rows(), 5000u);
    ASSERT_EQ(imaged.size(), echoes.rows());
    for (const ImagedEcho& echo : imaged) EXPECT_TRUE(echo.is_visible) << echo.echo;
  }
}

// Between its echo and the image a box moves and turns; it occludes from its pose at the time of
// the image.
TEST(LidarImage, MovesPointsWithTheirObjects) {
  const Pose first{rotation_from_yaw_pitch_roll(0.3, 0, 0), {10, 3, 1}};
  const Pose last{rotation_from_yaw_pitch_roll(0.9, 0, 0), {11, -5, 1}};
  const Trajectory X_DO({{0s, first}, {1s, last}});
  const Scene scene = scene_of(Tracing::Exact, {}, {{X_DO, 1, 0}});
  const Trajectory X_DS = path({{1, 0, 0, 0}, {0, 0, 2}}, {0, 0, 0});
  const glm::dvec3 p_DC(0, -1, 1.5);
  const nanoseconds begin = 400ms, seen_at = begin + 3ms;
  const auto echoes = Lidar(vlp16()).scan(scene, X_DS, 1, Seed{1}, 0).echoes;
  const auto object = echoes.column<std::uint32_t>("instance");
  const auto time_s = echoes.column<float>("time");
  const auto x = echoes.column<double>("world_x"), y = echoes.column<double>("world_y"),
             z = echoes.column<double>("world_z");
  const nanoseconds stamp = ScanPattern(vlp16().pattern).stamp(1);
  const auto imaged =
      image_echoes(pinhole({0.006, 0}), scene, path({R_DC, p_DC}, {0, 0, 0}), begin, echoes, stamp);
  int moved = 0, hidden = 0;
  for (const ImagedEcho& echo : imaged) {
    glm::dvec3 p_DQ(x[echo.echo], y[echo.echo], z[echo.echo]);
    if (object[echo.echo] == 1) {
      const auto fired = stamp + nanoseconds(std::llround(1e9 * double{time_s[echo.echo]}));
      p_DQ = X_DO.pose_at(seen_at) * (inverse(X_DO.pose_at(fired)) * p_DQ);
      moved += echo.is_visible;
    }
    const glm::dvec3 way = p_DQ - p_DC;
    if (!echo.is_inside) continue;
    EXPECT_NEAR(echo.u_px, centre_px.x - focal_px * way.y / way.x, 1e-9);
    EXPECT_NEAR(echo.v_px, centre_px.y - focal_px * way.z / way.x, 1e-9);
    const Pose X_OD = inverse(X_DO.pose_at(seen_at));
    const glm::dvec3 before = p_DC + way * (1 - 1e-5 / glm::length(way));
    EXPECT_EQ(echo.is_visible, !passes(X_OD * p_DC, X_OD * before));
    hidden += !echo.is_visible;
  }
  EXPECT_GT(moved, 50);
  EXPECT_GT(hidden, 50);
}

// A scan of given points, on flat ground at their height.
PointCloud cloud_of(const std::vector<glm::dvec3>& points) {
  PointCloud cloud(points.size());
  const std::array position{cloud.add<double>("world_x"), cloud.add<double>("world_y"),
                            cloud.add<double>("world_z")};
  const std::array normal{cloud.add<float>("nx"), cloud.add<float>("ny"), cloud.add<float>("nz")};
  const auto range_m = cloud.add<double>("range_true");
  const auto time_s = cloud.add<float>("time");
  const auto object = cloud.add<std::uint32_t>("instance");
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      position[static_cast<std::size_t>(k)][i] = points[i][k];
      normal[static_cast<std::size_t>(k)][i] = k == 2;
    }
    range_m[i] = 10;
    time_s[i] = 0;
    object[i] = 0;
  }
  return cloud;
}

// A camera that flies past and sinks, with a rolling shutter: with t = t0 + row_s v and v = c + f
// (h - s t) / Z, v is the quotient below.
TEST(LidarImage, ProjectsPointsAtTheExposureOfTheirRows) {
  const ShutterSpec shutter{0.004, 50e-6};
  const glm::dvec3 p_DC(0, 0, 3), velocity_m_s(0, 6, -4);
  const Scene scene = scene_of(Tracing::Exact, {}, {});
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(4 + i, 0.2 * i - 3.6, 0);
  const auto imaged = image_echoes(pinhole(shutter), scene, path({R_DC, p_DC}, velocity_m_s), 100ms,
                                   cloud_of(points), 0s);
  ASSERT_EQ(imaged.size(), points.size());
  int inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3& p = points[i];
    const double t0 = 0.1 + shutter.exposure_s / 2, pace = focal_px * velocity_m_s.z / p.x;
    const double v =
        (centre_px.y - focal_px * (p.z - p_DC.z) / p.x + pace * t0) / (1 - pace * shutter.row_s);
    if (v < 0 || v > size_px.y - 1) continue;  // the first or last row exposes such points
    const double t = t0 + shutter.row_s * v;
    const double u = centre_px.x - focal_px * (p.y - p_DC.y - velocity_m_s.y * t) / p.x;
    // Times are whole nanoseconds, in which the image moves less than 1e-6 px.
    EXPECT_NEAR(imaged[i].v_px, v, 1e-6);
    EXPECT_NEAR(imaged[i].u_px, u, 1e-6);
    EXPECT_EQ(imaged[i].is_visible, imaged[i].is_inside);
    inside += imaged[i].is_inside;
  }
  EXPECT_GT(inside, 20);
}

TEST(LidarImage, WritesRowsThatNumPyReads) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "top.npy";
  const std::vector<ImagedEcho> rows{{7, 1.5, 2.5, 30, true, false}, {9, -4, 2, 3, false, false}};
  write_imaged_echoes(file, rows);
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_THAT(text, HasSubstr("[('echo', '<u4'), ('u_px', '<f8'), ('v_px', '<f8'), ('depth_m', "
                              "'<f8'), ('is_inside', '|u1'), ('is_visible', '|u1')]"));
  ASSERT_EQ(text.size() % 64, 60u);
  double v_px = 0;
  std::memcpy(&v_px, text.data() + text.size() - 60 + 12, sizeof(v_px));
  EXPECT_EQ(v_px, 2.5);
  EXPECT_EQ(text[text.size() - 32], '\1');
}

TEST(LidarImage, RejectsImagesThatTheTrajectoryDoesNotCover) {
  const Scene scene = scene_of(Tracing::Fast, {}, {});
  const Trajectory X_DC = path({R_DC, {0, 0, 1}}, {0, 0, 0});
  EXPECT_THAT(
      [&] {
        image_echoes(pinhole({0.1, 0}), scene, X_DC, 950ms, cloud_of({{5, 0, 0}}), 0s);
      },
      ThrowsMessage<Error>(HasSubstr("trajectory covers [0.000000, 1.000000] s")));
  EXPECT_THAT(
      [&] {
        image_echoes(pinhole({0.1, 0}), scene, X_DC, 0s, PointCloud(3), 0s);
      },
      ThrowsMessage<Error>(HasSubstr("world_x")));
}

}  // namespace
}  // namespace groundray::lidar_image_test
