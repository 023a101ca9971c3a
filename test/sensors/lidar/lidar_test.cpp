#include "sensors/lidar/lidar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <set>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/reference_tracer.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::lidar_test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

LidarSpec preset(const std::string& name) {
  return load_lidar(testing::data_folder() / "sensors" / (name + ".yaml"));
}

Scene scene_of(const HeightGrid& ground, Tracing tracing = Tracing::Fast) {
  return {RayTracer({full_resolution_level(ground)}, {0, 0, 0}, tracing), {3, 4}};
}

HeightGrid flat_ground(double height_m) {
  return {
      {2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, static_cast<float>(height_m))};
}

Trajectory still_at(const glm::dvec3& p) {
  return Trajectory({{0s, {{1, 0, 0, 0}, p}}, {2s, {{1, 0, 0, 0}, p}}});
}

// A fast, turning, rolling ride over `ground`: every pulse has its own pose.
Trajectory ride_over(const HeightGrid& ground) {
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 20; ++k) {
    const double t_s = 0.1 * k;
    const glm::dvec2 p(20 * t_s, 5 * std::sin(t_s));
    const glm::dvec3 p_DS(p, *ground.height_m_at(p) + 2.5 + 0.3 * std::sin(7 * t_s));
    samples.push_back(
        {100ms * k,
         {rotation_from_yaw_pitch_roll(0.8 * t_s, 0.1 * std::sin(5 * t_s), 0.1 * std::cos(4 * t_s)),
          p_DS}});
  }
  return Trajectory(std::move(samples));
}

// Reference implementation of a scan, pulse by pulse, directly from the spec: origin of beam `ring`
// at `time_s`, in D.
glm::dvec3 beam_origin(const SpinningPattern& pattern, std::uint16_t ring, double time_s,
                       const Pose& X_DS) {
  const Beam& beam = *std::ranges::find(pattern.beams, ring, &Beam::ring);
  const double sense = pattern.sense == SpinningPattern::Sense::Clockwise ? -1 : 1;
  const double spin_rad =
      pattern.start_azimuth_rad + sense * 2 * std::numbers::pi * pattern.rate_hz * time_s;
  return X_DS *
         glm::dvec3(beam.origin_m.x * std::cos(spin_rad) - beam.origin_m.y * std::sin(spin_rad),
                    beam.origin_m.x * std::sin(spin_rad) + beam.origin_m.y * std::cos(spin_rad),
                    beam.origin_m.z);
}

TEST(Lidar, EchoesOfFlatGroundLieInOnePlane) {
  constexpr float tolerance =
      4 * std::numeric_limits<float>::epsilon();  // range, sine, product, offset: one rounding each
  const Lidar lidar(preset("velodyne_vlp16"));
  for (const float height_m : {0.5f, 2.0f, 20.0f}) {
    const PointCloud scan =
        lidar.scan(scene_of(flat_ground(0)), still_at({0, 0, height_m}), 0, Seed{7}, 0).echoes;
    ASSERT_GT(scan.rows(), 0u);
    const auto x = scan.column<float>("x");
    const auto z = scan.column<float>("z");
    for (std::size_t i = 0; i < scan.rows(); ++i)
      ASSERT_NEAR(z[i], -height_m, tolerance * (height_m + std::abs(x[i])));
  }
}

TEST(Lidar, EveryDownwardBeamReturnsOncePerSequence) {
  const Lidar lidar(preset("velodyne_vlp16"));
  const PointCloud scan =
      lidar.scan(scene_of(flat_ground(0)), still_at({0, 0, 1}), 0, Seed{7}, 0).echoes;
  std::map<std::uint16_t, int> echoes;
  for (const std::uint16_t ring : scan.column<std::uint16_t>("ring")) ++echoes[ring];
  const auto sequences = lidar.pattern().pulses(0) / 16;
  EXPECT_EQ(sequences, 1809);  // 0.1 s / 55.296 us = 1808.4
  EXPECT_EQ(echoes.size(),
            8u);  // rings 0 to 7 look 15 to 1 degrees down: at 1 m height the last reaches 57 m
  for (const auto& [ring, count] : echoes) EXPECT_EQ(count, sequences) << ring;
}

TEST(Lidar, PointsLieOnTheSurfaceAtTheirRangeFromTheBeamsOrigin) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const Trajectory X_DS = ride_over(ground);
  for (const char* name :
       {"velodyne_vlp16", "velodyne_hdl64e_s3", "velodyne_vls128", "ouster_os0_128"}) {
    const LidarSpec spec = preset(name);
    const Lidar lidar(spec);
    const PointCloud scan = lidar.scan(scene_of(ground), X_DS, 3, Seed{7}, 0).echoes;
    ASSERT_GT(scan.rows(), 5000u);
    const auto x = scan.column<float>("x"), y = scan.column<float>("y"),
               z = scan.column<float>("z");
    const auto wx = scan.column<double>("world_x"), wy = scan.column<double>("world_y"),
               wz = scan.column<double>("world_z");
    const auto nz = scan.column<float>("nz");
    const auto range_m = scan.column<double>("range_true");
    const auto time_s = scan.column<float>("time");
    const auto ring = scan.column<std::uint16_t>("ring");
    float last_time_s = 0;
    for (std::size_t i = 0; i < scan.rows(); ++i) {
      const glm::dvec3 p_DQ(wx[i], wy[i], wz[i]);
      const double slope = std::sqrt(1 / (double(nz[i]) * nz[i]) - 1);
      const double off_m = p_DQ.z - testing::reference_height_m(ground, p_DQ.x, p_DQ.y);
      ASSERT_NEAR(off_m, 0, 1e-9 * (1 + slope)) << name << i;
      testing::record_margin("distance to the surface", off_m / (1e-9 * (1 + slope)), 1);

      // The time column is a float: half an ulp of 0.1 s is 4 ns, which at 20 m/s and 63 rad/s on
      // 0.2 m is 1e-7 m.
      const auto time =
          lidar.pattern().stamp(3) + std::chrono::nanoseconds(std::llround(1e9 * time_s[i]));
      const Pose X_DS_now = X_DS.pose_at(time);
      const glm::dvec3 p_DO = beam_origin(std::get<SpinningPattern>(spec.pattern), ring[i],
                                          1e-9 * static_cast<double>(time.count()), X_DS_now);
      ASSERT_NEAR(range_m[i], glm::length(p_DQ - p_DO), 3e-7) << name << i;
      ASSERT_LT(glm::length(X_DS_now * glm::dvec3(x[i], y[i], z[i]) - p_DQ), 1e-4) << name << i;
      testing::record_margin("range_true", range_m[i] - glm::length(p_DQ - p_DO), 3e-7, "m");
      testing::record_margin(
          "points in S", glm::length(X_DS_now * glm::dvec3(x[i], y[i], z[i]) - p_DQ), 1e-4, "m");
      ASSERT_GE(time_s[i], last_time_s);
      last_time_s = time_s[i];
    }
  }
}

TEST(Lidar, ExactAndFastTracingReturnTheSameScan) {
  const HeightGrid ground =
      testing::with_holes(testing::fractal(513, 1, 60, Seed{1}), 20, 5, Seed{2});
  const Trajectory X_DS = still_at({0, 0, ground.max_height_m() + 2});
  const Lidar lidar(preset("velodyne_vls128"));
  const PointCloud fast = lidar.scan(scene_of(ground), X_DS, 0, Seed{7}, 0).echoes;
  const PointCloud exact = lidar.scan(scene_of(ground, Tracing::Exact), X_DS, 0, Seed{7}, 0).echoes;
  // 240,000 pulses at 5e-6: at most one may differ; with this seed none does.
  ASSERT_EQ(fast.rows(), exact.rows());
  EXPECT_THAT(fast.column<double>("range_true"),
              ::testing::ElementsAreArray(exact.column<double>("range_true")));
}

void expect_same_bytes(const PointCloud& a, const PointCloud& b) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.columns().size(), b.columns().size());
  for (std::size_t i = 0; i < a.columns().size(); ++i) {
    EXPECT_EQ(a.columns()[i].name, b.columns()[i].name);
    EXPECT_TRUE(a.columns()[i].values == b.columns()[i].values) << a.columns()[i].name;
  }
}

TEST(Lidar, SameBytesForAnyNumberOfThreads) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  LidarSpec spec = preset("velodyne_vlp16");
  spec.range_noise_sigma_m = 0.02;
  const Lidar lidar(spec);
  const Trajectory X_DS = ride_over(ground);
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    std::vector<PointCloud> scans;
    for (const std::size_t threads : {1, 2, 5}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      scans.push_back(lidar.scan(scene_of(ground, tracing), X_DS, 5, Seed{7}, 0).echoes);
    }
    expect_same_bytes(scans[0], scans[1]);
    expect_same_bytes(scans[0], scans[2]);
  }
}

TEST(Lidar, RangeNoiseIsGaussianAlongTheBeamAndKeepsTheTruth) {
  LidarSpec spec = preset("velodyne_vlp16");
  const Scene scene = scene_of(flat_ground(0));
  const PointCloud clean = Lidar(spec).scan(scene, still_at({0, 0, 2}), 0, Seed{7}, 0).echoes;
  spec.range_noise_sigma_m = 0.05;
  const PointCloud noisy = Lidar(spec).scan(scene, still_at({0, 0, 2}), 0, Seed{7}, 0).echoes;
  const auto truth = clean.column<double>("range_true");
  ASSERT_THAT(noisy.column<double>("range_true"), ::testing::ElementsAreArray(truth));
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < noisy.rows(); ++i) {
    const auto at = [&](const PointCloud& scan) {
      return glm::dvec3(scan.column<float>("x")[i], scan.column<float>("y")[i],
                        scan.column<float>("z")[i]);
    };
    const glm::dvec3 moved = at(noisy) - at(clean);
    const double error_m = glm::length(moved) * (glm::dot(moved, at(clean)) < 0 ? -1 : 1);
    sum += error_m / 0.05;
    square += error_m * error_m / (0.05 * 0.05);
  }
  const auto n = static_cast<double>(noisy.rows());
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));  // 5 standard errors: p = 6e-7
  EXPECT_NEAR(square / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_THAT(noisy.column<float>("range_sd"), ::testing::Each(0.05f));
  EXPECT_FALSE(clean.has("range_sd"));
  testing::record_margin("mean", sum / n, 5 / std::sqrt(n));
  testing::record_margin("variance", square / n - 1, 5 * std::sqrt(2 / n));
}

TEST(Lidar, NoiseDependsOnSeedSensorAndSweep) {
  LidarSpec spec = preset("velodyne_vlp16");
  spec.range_noise_sigma_m = 0.05;
  const Lidar lidar(spec);
  const Scene scene = scene_of(flat_ground(0));
  const Trajectory X_DS = still_at({0, 0, 2});
  std::set<float> first;
  first.insert(lidar.scan(scene, X_DS, 0, Seed{7}, 0).echoes.column<float>("z")[0]);
  first.insert(lidar.scan(scene, X_DS, 0, Seed{8}, 0).echoes.column<float>("z")[0]);
  first.insert(lidar.scan(scene, X_DS, 0, Seed{7}, 1).echoes.column<float>("z")[0]);
  first.insert(lidar.scan(scene, X_DS, 1, Seed{7}, 0).echoes.column<float>("z")[0]);
  EXPECT_EQ(first.size(), 4u);
}

TEST(Lidar, ReportsNothingOutsideItsGate) {
  LidarSpec spec = preset("velodyne_vlp16");
  spec.gate = {5, 20};
  const PointCloud scan =
      Lidar(spec).scan(scene_of(flat_ground(0)), still_at({0, 0, 1}), 0, Seed{7}, 0).echoes;
  const auto range_m = scan.column<double>("range_true");
  ASSERT_GT(scan.rows(), 0u);
  EXPECT_THAT(range_m, ::testing::Each(::testing::AllOf(::testing::Ge(5), ::testing::Le(20))));
}

TEST(Lidar, ReportsIncidenceNormalAndLabels) {
  const PointCloud scan = Lidar(preset("velodyne_vlp16"))
                              .scan(scene_of(flat_ground(0)), still_at({0, 0, 2}), 0, Seed{7}, 0)
                              .echoes;
  const auto ring = scan.column<std::uint16_t>("ring");
  const auto incidence_rad = scan.column<float>("incidence");
  for (std::size_t i = 0; i < scan.rows(); ++i) {
    const double down_rad =
        (15 - 2.0 * ring[i]) * std::numbers::pi / 180;  // elevations run from -15 in steps of 2
    ASSERT_NEAR(incidence_rad[i], std::numbers::pi / 2 - down_rad, 1e-6);
  }
  EXPECT_THAT(scan.column<float>("nz"), ::testing::Each(1.0f));
  EXPECT_THAT(scan.column<std::uint16_t>("label"), ::testing::Each(3));
  EXPECT_THAT(scan.column<std::uint32_t>("instance"), ::testing::Each(4u));
  EXPECT_THAT(scan.column<float>("error_estimate"), ::testing::Each(0.0f));
}

TEST(Lidar, RejectsASweepThatItsTrajectoryDoesNotCover) {
  const Lidar lidar(preset("velodyne_vlp16"));
  EXPECT_THAT(
      [&] {
        lidar.scan(scene_of(flat_ground(0)), still_at({0, 0, 2}), 20, Seed{7}, 0);
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("sweep 20"), HasSubstr("covers [0.000000, 2.000000] s"))));
}

TEST(Lidar, RejectsAGateWithItsEndsSwapped) {
  LidarSpec spec = preset("velodyne_vlp16");
  spec.gate = {100, 1};
  spec.range_noise_sigma_m = -1;
  EXPECT_THAT([&] { Lidar{spec}; },
              ThrowsMessage<Error>(AllOf(HasSubstr("range gate [100, 1] m is empty"),
                                         HasSubstr("range noise of -1 m"))));
}

}  // namespace
}  // namespace groundray::lidar_test
