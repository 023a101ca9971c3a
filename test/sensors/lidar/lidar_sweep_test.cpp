// Whole sweeps of lidars with simulated light and all random effects.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <string_view>

#include "apps/scene/readers/scene_reader.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::lidar_sweep_test {
namespace {

using namespace std::chrono_literals;

Scene scene_of(const HeightGrid& ground) {
  return {RayTracer({full_resolution_level(ground)}, {0, 0, 0}, Tracing::Fast),
          {.label = 3, .instance = 4, .material = 0},
          {{"grey", Lambertian{{{300, 0.4}, {2500, 0.4}}}}}};
}

// A preset with all random effects.
LidarSpec noisy() {
  LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vlp16.yaml");
  spec.beam.divergence_rad = {3e-3, 1.5e-3};
  spec.beam.sub_rays = 16;
  spec.beam.most_sub_rays = 64;
  spec.beam.turn = BeamSpec::Turn::EachPulse;
  spec.light.emplace();
  spec.light->wavelength_nm = 905;
  spec.light->optics = {.pulse_energy_j = 1e-7, .aperture_diameter_m = 0.025};
  spec.light->pulse.fwhm_s = 5e-9;
  spec.light->receiver.timing = ReceiverSpec::Timing::CentreOfGravity;
  spec.light->receiver.returns = ReceiverSpec::Returns::All;
  spec.light->receiver.response_fwhm_s = 3e-9;
  spec.light->receiver.noise = NoiseSpec{.nep_w_per_sqrt_hz = 1e-12,
                                         .quantum_efficiency = 0.5,
                                         .excess_noise_factor = 3,
                                         .false_alarm_rate_hz = 2e3};
  spec.light->overlap = {0.5, 3};
  spec.light->sun = {.irradiance_w_m2_nm = 0.7, .filter_width_nm = 30, .field_of_view_sr = 1e-5};
  spec.range_noise_sigma_m = 0.01;
  spec.angular_jitter_rad = 1e-3;
  spec.no_returns = LidarSpec::NoReturns::Report;
  spec.waveforms = LidarSpec::WaveformOutput::Keep;
  return spec;
}

Trajectory ride_over(const HeightGrid& ground) {
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 20; ++k) {
    const double t_s = 0.1 * k;
    const glm::dvec2 p(20 * t_s, 5 * std::sin(t_s));
    samples.push_back({100ms * k,
                       {rotation_from_yaw_pitch_roll(0.8 * t_s, 0.1 * std::sin(5 * t_s), 0.05),
                        {p, *ground.height_m_at(p) + 2.5}}});
  }
  return Trajectory(std::move(samples));
}

// Compares bytes, so that NaNs are equal.
std::string_view bytes_of(const PointCloud::Column& column) {
  return std::visit(
      [](const auto& values) {
        return std::string_view(reinterpret_cast<const char*>(values.data()),
                                values.size() * sizeof(values[0]));
      },
      column.values);
}

void expect_same_bytes(const PointCloud& a, const PointCloud& b) {
  ASSERT_EQ(a.rows(), b.rows());
  for (std::size_t i = 0; i < a.columns().size(); ++i)
    EXPECT_EQ(bytes_of(a.columns()[i]), bytes_of(b.columns()[i])) << a.columns()[i].name;
}

TEST(LidarSweep, SameBytesForAnyNumberOfThreadsWithAllNoiseOn) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const Lidar lidar(noisy(), {.visibility_m = 5000, .backscatter_per_m_sr = 1e-5});
  const Trajectory X_DS = ride_over(ground);
  std::vector<LidarScan> scans;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    scans.push_back(lidar.scan(scene_of(ground), X_DS, 3, Seed{7}, 0));
  }
  ASSERT_GT(scans[0].echoes.rows(), 5000u);
  ASSERT_GT(scans[0].no_returns.rows(), 1000u);
  const auto kinds = scans[0].echoes.column<std::uint8_t>("kind");
  EXPECT_GT(std::ranges::count(kinds, 2), 0);  // false alarms
  for (const LidarScan* other : {&scans[1], &scans[2]}) {
    expect_same_bytes(scans[0].echoes, other->echoes);
    expect_same_bytes(scans[0].no_returns, other->no_returns);
    EXPECT_EQ(scans[0].waveforms.power_w, other->waveforms.power_w);
    EXPECT_EQ(scans[0].convergence.range_m.sum_squares, other->convergence.range_m.sum_squares);
    EXPECT_EQ(scans[0].convergence.share.sum_squares, other->convergence.share.sum_squares);
  }
}

TEST(LidarSweep, IsTheSameWithAndWithoutAProgressCallback) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const Scene scene = scene_of(ground);
  const Trajectory X_DS = ride_over(ground);
  LidarSpec spec = noisy();
  for (const bool has_light : {true, false}) {
    SCOPED_TRACE(has_light ? "with light" : "without");
    if (!has_light) {
      spec.light.reset();
      spec.beam = {};
      spec.waveforms = LidarSpec::WaveformOutput::Omit;
    }
    const Lidar lidar(spec);
    std::vector<double> shares;
    const LidarScan watched = lidar.scan(scene, X_DS, 3, Seed{7}, 0, [&](double share) {
      shares.push_back(share);
      return true;
    });
    ASSERT_GT(shares.size(), 10u);
    EXPECT_EQ(shares.front(), 0);
    EXPECT_LE(shares.back(), 1);
    EXPECT_EQ(std::ranges::adjacent_find(shares, std::greater_equal<>()), shares.end());
    const LidarScan alone = lidar.scan(scene, X_DS, 3, Seed{7}, 0);
    ASSERT_GT(alone.echoes.rows(), 5000u);
    ASSERT_GT(alone.no_returns.rows(), 1000u);
    expect_same_bytes(alone.echoes, watched.echoes);
    expect_same_bytes(alone.no_returns, watched.no_returns);
    EXPECT_EQ(alone.waveforms.power_w, watched.waveforms.power_w);
  }
}

// No more pulses begin, and the callback is not called again.
TEST(LidarSweep, StopsWhenTheProgressCallbackRequestsIt) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const Scene scene = scene_of(ground);
  const Trajectory X_DS = ride_over(ground);
  const Lidar lidar(noisy());
  for (const double until : {0.0, 0.5}) {
    std::vector<double> shares;
    const auto scan = [&] {
      return lidar.scan(scene, X_DS, 3, Seed{7}, 0, [&](double share) {
        shares.push_back(share);
        return share < until;
      });
    };
    EXPECT_THROW(scan(), SweepStopped);
    ASSERT_FALSE(shares.empty());
    EXPECT_GE(shares.back(), until);
    EXPECT_LT(shares.back(), until + 0.1);
    EXPECT_EQ(std::ranges::count_if(shares, [&](double share) { return share >= until; }), 1);
  }
}

// A request after the last pulse has begun is too late: the whole sweep is returned.
TEST(LidarSweep, IsCompleteIfTheStopComesTooLate) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const Scene scene = scene_of(ground);
  const Trajectory X_DS = ride_over(ground);
  const Lidar lidar(noisy());
  const LidarScan alone = lidar.scan(scene, X_DS, 3, Seed{7}, 0);
  const LidarScan watched =
      lidar.scan(scene, X_DS, 3, Seed{7}, 0, [](double share) { return share < 1; });
  expect_same_bytes(alone.echoes, watched.echoes);
  expect_same_bytes(alone.no_returns, watched.no_returns);
}

TEST(LidarSweep, EchoesDoNotDependOnOptionalOutputs) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  LidarSpec spec = noisy();
  spec.gate = {2, 20};
  const auto echoes = [&] {
    return Lidar(spec).scan(scene_of(ground), ride_over(ground), 3, Seed{7}, 0).echoes;
  };
  const PointCloud with_all = echoes();
  spec.no_returns = LidarSpec::NoReturns::Omit;
  spec.waveforms = LidarSpec::WaveformOutput::Omit;
  ASSERT_GT(with_all.rows(), 1000u);
  expect_same_bytes(with_all, echoes());
}

TEST(LidarSweep, FalseAlarmsAndEchoesOfAirHaveNoTruth) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const LidarScan found = Lidar(noisy()).scan(scene_of(ground), ride_over(ground), 3, Seed{7}, 0);
  const auto kind = found.echoes.column<std::uint8_t>("kind");
  const auto label = found.echoes.column<std::uint16_t>("label");
  const auto truth_m = found.echoes.column<double>("range_true");
  for (std::size_t i = 0; i < found.echoes.rows(); ++i) {
    EXPECT_EQ(std::isnan(truth_m[i]), kind[i] != 0);
    EXPECT_EQ(label[i], kind[i] == 0 ? 3 : 0);
  }
}

// Sub-rays of a Gaussian lie within 3 radii of the axis (docs/theory/lidar_beam.md), and so does
// any mean of them. Jitter is off: the axis is the direction that the sensor reports.
TEST(LidarSweep, EchoesLieInsideTheirBeam) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  LidarSpec spec = noisy();
  spec.light->receiver.noise.reset();
  spec.light->receiver.threshold_w = 1e-12;
  spec.angular_jitter_rad = 0;
  const Trajectory X_DS = ride_over(ground);
  const Lidar lidar(spec);
  const LidarScan found = lidar.scan(scene_of(ground), X_DS, 3, Seed{7}, 0);
  const auto time_s = found.echoes.column<float>("time");
  for (std::size_t i = 0; i < found.echoes.rows(); ++i) {
    const auto time =
        lidar.pattern().stamp(3) + std::chrono::nanoseconds(std::llround(1e9 * time_s[i]));
    const auto at = [&](auto x, auto y, auto z) { return glm::dvec3(x[i], y[i], z[i]); };
    const PointCloud& e = found.echoes;
    const glm::dvec3 p_SQ =
        inverse(X_DS.pose_at(time)) *
        at(e.column<double>("world_x"), e.column<double>("world_y"), e.column<double>("world_z"));
    const glm::dvec3 axis =
        glm::normalize(at(e.column<float>("x"), e.column<float>("y"), e.column<float>("z")));
    const double off_rad = std::asin(glm::length(glm::cross(axis, glm::normalize(p_SQ))));
    // A VLP-16 beam starts up to 11 mm from the origin, which the axis through the origin neglects.
    ASSERT_LT(off_rad, 3 * 1.5e-3 + 2 * 0.0112 / glm::length(p_SQ)) << i;
  }
}

TEST(LidarSweep, PointsAtTheStampAreDeskewed) {
  const HeightGrid ground = testing::fractal(513, 1, 60, Seed{1});
  const Trajectory X_DS = ride_over(ground);
  LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vlp16.yaml");
  spec.points = LidarSpec::Points::AtStamp;
  const Lidar lidar(spec);
  const PointCloud e = lidar.scan(scene_of(ground), X_DS, 3, Seed{7}, 0).echoes;
  const Pose X_DS_stamp = X_DS.pose_at(lidar.pattern().stamp(3));
  ASSERT_GT(e.rows(), 5000u);
  for (std::size_t i = 0; i < e.rows(); ++i) {
    const glm::dvec3 p_SQ(e.column<float>("x")[i], e.column<float>("y")[i],
                          e.column<float>("z")[i]);
    const glm::dvec3 p_DQ(e.column<double>("world_x")[i], e.column<double>("world_y")[i],
                          e.column<double>("world_z")[i]);
    ASSERT_LT(glm::length(X_DS_stamp * p_SQ - p_DQ), 3e-5) << i;  // floats of 100 m
  }
}

TEST(LidarSweep, ConvergenceComparesEvery64thPulseWithTwiceItsSubRays) {
  LidarSpec spec = noisy();
  spec.beam.turn = BeamSpec::Turn::Fixed;
  const auto of = [&](int sub_rays, const HeightGrid& ground, const Trajectory& X_DS) {
    spec.beam.sub_rays = sub_rays;
    spec.beam.most_sub_rays = sub_rays;
    return Lidar(spec).scan(scene_of(ground), X_DS, 0, Seed{7}, 0).convergence;
  };
  const HeightGrid rough = testing::fractal(513, 1, 60, Seed{1});
  const Convergence few = of(16, rough, ride_over(rough));
  const Convergence many = of(256, rough, ride_over(rough));
  EXPECT_EQ(few.pulses, (16u * 1809 + 63) / 64);
  EXPECT_EQ(many.pulses, few.pulses);
  EXPECT_GT(few.changed, 0u);  // edges
  EXPECT_EQ(few.true_m.count, few.range_m.count);
  EXPECT_EQ(few.share.count, few.range_m.count);
  for (const auto changes : {&Convergence::range_m, &Convergence::true_m, &Convergence::share}) {
    EXPECT_GT((few.*changes).largest, 1e-3);
    EXPECT_LT((many.*changes).rms(), (few.*changes).rms());
    EXPECT_LE((few.*changes).rms(), (few.*changes).largest);
  }
  // A plane's echo depends on the fourth moments of the beam alone; the remaining difference is
  // sampling.
  const HeightGrid plane({2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, 0.0f));
  const Pose above{{1, 0, 0, 0}, {0, 0, 2}};
  const Trajectory still({{0s, above}, {2s, above}});
  const Convergence flat = of(16, plane, still);
  EXPECT_EQ(flat.changed, 0u);
  EXPECT_GT(flat.range_m.count, 200u);
  EXPECT_LT(flat.range_m.largest, 1e-6);
  EXPECT_LT(flat.true_m.largest, 1e-6);
  EXPECT_EQ(flat.share.largest, 0);
}

}  // namespace
}  // namespace groundray::lidar_sweep_test
