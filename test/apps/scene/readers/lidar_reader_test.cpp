#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <glm/trigonometric.hpp>
#include <limits>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "sensors/lidar/lidar.h"
#include "test/support/scans/lidar_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::lidar_reader_test {
namespace {

using groundray::testing::lidar_text;
using groundray::testing::spinning;
using groundray::testing::TemporaryFolder;
using groundray::testing::with;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::string lidar_complaint(std::string_view old, std::string_view fresh) {
  try {
    parse_lidar(with(lidar_text, old, fresh), "mine.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(LidarFile, ReadsEveryKey) {
  const LidarSpec lidar = parse_lidar(lidar_text, "mine.yaml");
  EXPECT_EQ(lidar.model, "Two beams");
  EXPECT_EQ(spinning(lidar).rate_hz, 10);
  EXPECT_EQ(spinning(lidar).sense, SpinningPattern::Sense::CounterClockwise);
  EXPECT_DOUBLE_EQ(spinning(lidar).start_azimuth_rad, glm::radians(180.));
  EXPECT_DOUBLE_EQ(spinning(lidar).firing_period_s, 1e-4);
  EXPECT_EQ(lidar.gate.near_m, 0.3);
  EXPECT_EQ(lidar.gate.far_m, std::numeric_limits<double>::infinity());
  ASSERT_EQ(spinning(lidar).beams.size(), 2u);
  const Beam& beam = spinning(lidar).beams[1];
  EXPECT_EQ(beam.ring, 0);
  EXPECT_DOUBLE_EQ(beam.elevation_rad, glm::radians(30.));
  EXPECT_DOUBLE_EQ(beam.azimuth_offset_rad, glm::radians(-2.));
  EXPECT_EQ(spinning(lidar).beams[0].origin_m, glm::dvec3(0, 0, 0.01));
  EXPECT_DOUBLE_EQ(beam.firing_time_s, 50e-6);
}

TEST(LidarFile, RejectsBeamsThatDoNotFitTheirColumns) {
  EXPECT_THAT(
      lidar_complaint("0.01, 0]", "0.01]"),
      HasSubstr("mine.yaml:12:5: key 'beams': is a list of 4, but must be a list of 5 numbers"));
  EXPECT_THAT(lidar_complaint("[1, -30", "[1.5, -30"),
              HasSubstr(":12:6: key 'ring': is 1.5, but must be a whole number from 0 to 65535"));
  EXPECT_THAT(lidar_complaint("-30", "-91"),
              HasSubstr(":12:9: key 'elevation_deg': is -91, but must be from -90 to 90"));
  EXPECT_THAT(lidar_complaint("0, 50]", "0, 100]"),
              HasSubstr(":13:5: key 'beams': firing_time_us must be less than firing_period_us"));
  EXPECT_THAT(lidar_complaint("0, 50]", "0, -1]"),
              HasSubstr(":13:24: key 'firing_time_us': is -1, but must be >= 0"));
}

TEST(LidarFile, RejectsUnknownMissingAndRepeatedColumns) {
  EXPECT_THAT(lidar_complaint("elevation_deg", "elevation_rad"),
              HasSubstr(":10:22: key 'beam_columns': 'elevation_rad' is not a column of beams; did "
                        "you mean 'elevation_deg'?"));
  EXPECT_THAT(lidar_complaint("firing_time_us]", "origin_x_m]"),
              HasSubstr(":10:15: key 'beam_columns': lacks firing_time_us"));
  EXPECT_THAT(lidar_complaint("firing_time_us]", "ring]"),
              HasSubstr("key 'beam_columns': 'ring' is repeated"));
}

TEST(LidarFile, RejectsValuesOutOfRange) {
  EXPECT_THAT(
      lidar_complaint("counter_clockwise", "ccw"),
      HasSubstr(":5:10: key 'sense': is 'ccw', but must be one of clockwise, counter_clockwise"));
  EXPECT_THAT(lidar_complaint("firing_period_us: 100", "firing_period_us: 1e-9"),
              HasSubstr(":7:19: key 'firing_period_us': yields 1e+14 firing sequences per turn, "
                        "but must yield 1 to 1000000"));
  EXPECT_THAT(lidar_complaint("near: 0.3", "near: 3\n  far: 2"),
              HasSubstr(":9:3: key 'range_gate_m': near must be less than far"));
  EXPECT_THAT(lidar_complaint("a made-up lidar", "[a made-up lidar]"),
              HasSubstr(":15:10: key 'beams': is a list of 1, but must be a text"));
  EXPECT_THAT(lidar_complaint("  - [1, -30, 2, 0.01, 0]\n  - [0, +3.0e1, -2, 0, 50]\n", "  []\n"),
              HasSubstr("key 'beams': has no rows"));
}

constexpr const char* physics_text = R"(
beam:
  profile: top_hat
  width: fwhm
  divergence_mrad: [3, 1.5]
  aperture_mm: [9, 5]
  sub_rays: 32
  most_sub_rays: 256
  turn: each_pulse
laser:
  wavelength_nm: 905
  pulse_energy_nj: 120
  pulse_shape: [0, 1, 3, 2, 0]
  pulse_shape_step_ns: 1.5
  efficiency: 0.9
receiver:
  aperture_mm: 25
  efficiency: 0.8
  response_fwhm_ns: 3
  sample_interval_ns: 0.5
  timing: constant_fraction
  threshold_w: 1e-8
  fraction: 0.4
  returns: dual
  most_returns: 3
  dead_time_ns: 10
  saturation_w: 1e-3
  calibrated_group_index: 1.0003
  overlap_m: [0.5, 3]
  range_step_mm: 4
  intensity: eight_bit
  full_scale_reflectance: 50
  noise:
    nep_w_per_sqrt_hz: 2e-12
    quantum_efficiency: 0.6
    excess_noise_factor: 3
    false_alarm_rate_hz: 100
    sun_w_m2_nm: 0.7
    filter_width_nm: 20
    field_of_view_mrad: 4
range_noise_sigma_m: 0.01
angular_jitter_mrad: 0.2
)";

TEST(LidarFile, ReadsBeamLaserAndReceiver) {
  const LidarSpec lidar = parse_lidar(std::string(lidar_text) + physics_text, "mine.yaml");
  EXPECT_EQ(lidar.beam.profile, BeamSpec::Profile::TopHat);
  EXPECT_EQ(lidar.beam.width, BeamSpec::Width::FullWidthHalfMaximum);
  EXPECT_EQ(lidar.beam.divergence_rad, glm::dvec2(3, 1.5) * 1e-3);
  EXPECT_EQ(lidar.beam.aperture_m, glm::dvec2(9, 5) * 1e-3);
  EXPECT_EQ(lidar.beam.sub_rays, 32);
  EXPECT_EQ(lidar.beam.most_sub_rays, 256);
  EXPECT_EQ(lidar.beam.turn, BeamSpec::Turn::EachPulse);
  ASSERT_TRUE(lidar.light);
  const LightSpec& light = *lidar.light;
  EXPECT_EQ(light.wavelength_nm, 905);
  EXPECT_DOUBLE_EQ(light.optics.pulse_energy_j, 120e-9);
  EXPECT_THAT(light.pulse.shape, ::testing::ElementsAre(0, 1, 3, 2, 0));
  EXPECT_DOUBLE_EQ(light.pulse.shape_step_s, 1.5e-9);
  EXPECT_EQ(light.pulse.fwhm_s, 0);
  EXPECT_EQ(light.optics.emitter_efficiency, 0.9);
  EXPECT_DOUBLE_EQ(light.optics.aperture_diameter_m, 0.025);
  EXPECT_EQ(light.optics.receiver_efficiency, 0.8);
  const ReceiverSpec& receiver = light.receiver;
  EXPECT_DOUBLE_EQ(receiver.response_fwhm_s, 3e-9);
  EXPECT_DOUBLE_EQ(receiver.sample_interval_s, 0.5e-9);
  EXPECT_EQ(receiver.timing, ReceiverSpec::Timing::ConstantFraction);
  EXPECT_EQ(receiver.threshold_w, 1e-8);
  EXPECT_EQ(receiver.fraction, 0.4);
  EXPECT_EQ(receiver.returns, ReceiverSpec::Returns::Dual);
  EXPECT_EQ(receiver.most_returns, 3);
  EXPECT_DOUBLE_EQ(receiver.dead_time_s, 10e-9);
  EXPECT_EQ(receiver.saturation_w, 1e-3);
  EXPECT_EQ(receiver.calibrated_group_index, 1.0003);
  EXPECT_EQ(light.overlap.none_below_m, 0.5);
  EXPECT_EQ(light.overlap.full_from_m, 3);
  EXPECT_DOUBLE_EQ(light.range_step_m, 4e-3);
  EXPECT_EQ(light.intensity.scale, IntensitySpec::Scale::EightBit);
  EXPECT_EQ(light.intensity.full_scale_reflectance, 50);
  ASSERT_TRUE(receiver.noise);
  EXPECT_EQ(receiver.noise->nep_w_per_sqrt_hz, 2e-12);
  EXPECT_EQ(receiver.noise->quantum_efficiency, 0.6);
  EXPECT_EQ(receiver.noise->excess_noise_factor, 3);
  EXPECT_EQ(receiver.noise->false_alarm_rate_hz, 100);
  EXPECT_EQ(light.sun.irradiance_w_m2_nm, 0.7);
  EXPECT_EQ(light.sun.filter_width_nm, 20);
  EXPECT_DOUBLE_EQ(light.sun.field_of_view_sr, cone_solid_angle_sr(4e-3));
  EXPECT_EQ(lidar.range_noise_sigma_m, 0.01);
  EXPECT_DOUBLE_EQ(lidar.angular_jitter_rad, 0.2e-3);
}

TEST(LidarFile, RejectsInconsistentPhysics) {
  const std::string text =
      with(with(std::string(lidar_text) + physics_text, "  threshold_w: 1e-8\n", ""), "near: 0.3",
           "near: 0.3\n  far: 90");
  const auto physics_complaint = [&](std::string_view old, std::string_view fresh) {
    try {
      Lidar(parse_lidar(with(text, old, fresh), "mine.yaml"));
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no complaint");
  };
  EXPECT_EQ(physics_complaint("range_noise", "range_noise"), "no complaint");
  EXPECT_THAT(physics_complaint("sub_rays: 32", "sub_rays: 24"), HasSubstr("sub_rays = 24"));
  EXPECT_THAT(physics_complaint("  pulse_energy_nj: 120\n", ""),
              HasSubstr("key 'pulse_energy_nj': missing"));
  EXPECT_THAT(physics_complaint("efficiency: 0.9", "efficiency: 90"),
              HasSubstr("key 'efficiency': is 90, but must be > 0 and at most 1"));
  EXPECT_THAT(physics_complaint("timing: constant_fraction", "timing: fraction"),
              HasSubstr("must be one of leading_edge, constant_fraction, peak, "));
  EXPECT_THAT(physics_complaint("  pulse_shape: [0, 1, 3, 2, 0]\n", "  pulse_fwhm_ns: 5\n"),
              HasSubstr("key 'pulse_shape_step_ns': is the step of pulse_shape"));
  EXPECT_THAT(physics_complaint("  pulse_shape: [0, 1, 3, 2, 0]\n  pulse_shape_step_ns: 1.5\n", ""),
              HasSubstr("fwhm"));
}

TEST(LidarFile, RequiresLaserAndReceiverTogether) {
  EXPECT_THAT(
      lidar_complaint("sources:", "laser: {wavelength_nm: 905, pulse_energy_nj: 1}\nsources:"),
      HasSubstr("key 'laser': needs 'receiver' too"));
}

// A lidar file with a pattern other than a spinning head's.
std::string with_pattern(std::string_view pattern) {
  return "groundray_lidar: 1\nmodel: Other\n" + std::string(pattern);
}

TEST(LidarFile, ReadsALineScanner) {
  const LidarSpec lidar = parse_lidar(with_pattern(R"(line:
  mirror: polygon
  plane: upright
  field_of_view_deg: [-40, 60]
  line_rate_hz: 120
  pulse_rate_hz: 100000
  facets: 3
  lines_per_sweep: 12
  head_rate_hz: 0.01
  head_start_deg: 90
)"),
                                      "a.yaml");
  const auto& line = std::get<LinePattern>(lidar.pattern);
  EXPECT_EQ(line.mirror, LinePattern::Mirror::Polygon);
  EXPECT_EQ(line.plane, LinePattern::Plane::Upright);
  EXPECT_DOUBLE_EQ(line.from_rad, glm::radians(-40.));
  EXPECT_DOUBLE_EQ(line.to_rad, glm::radians(60.));
  EXPECT_EQ(line.line_rate_hz, 120);
  EXPECT_EQ(line.pulse_rate_hz, 100000);
  EXPECT_EQ(line.lines_per_sweep, 12);
  EXPECT_EQ(line.head_rate_hz, 0.01);
  EXPECT_DOUBLE_EQ(line.head_start_rad, glm::radians(90.));
}

TEST(LidarFile, ReadsRisleyPrisms) {
  const LidarSpec lidar = parse_lidar(with_pattern(R"(risley:
  prisms:
    - {wedge_deg: 18, refractive_index: 1.51, rate_hz: 121.56, base_deg: 30}
    - {wedge_deg: 18, refractive_index: 1.51, rate_hz: -77.7, tilted_face: entry}
  sweep_rate_hz: 10
firing_period_us: 4.167
beam_columns: [ring, elevation_deg, firing_time_us]
beams:
  - [0, 0.1, 0]
)"),
                                      "a.yaml");
  const auto& risley = std::get<RisleyPattern>(lidar.pattern);
  ASSERT_EQ(risley.prisms.size(), 2u);
  EXPECT_DOUBLE_EQ(risley.prisms[0].wedge_rad, glm::radians(18.));
  EXPECT_EQ(risley.prisms[1].rate_hz, -77.7);
  EXPECT_DOUBLE_EQ(risley.prisms[0].base_rad, glm::radians(30.));
  EXPECT_EQ(risley.prisms[1].tilted, WedgePrism::Tilted::Entry);
  EXPECT_EQ(risley.sweep_rate_hz, 10);
  EXPECT_DOUBLE_EQ(risley.firing_period_s, 4.167e-6);
  EXPECT_EQ(risley.beams.size(), 1u);
}

TEST(LidarFile, ReadsPixelsAndTables) {
  const LidarSpec pixels = parse_lidar(with_pattern(R"(pixels:
  rows: 3
  columns: 4
  field_of_view_deg: [40, 30]
  spacing: equal_tangents
  column_period_us: 2
  frame_rate_hz: 20
)"),
                                       "a.yaml");
  EXPECT_EQ(std::get<TablePattern>(pixels.pattern).shots.size(), 12u);
  EXPECT_DOUBLE_EQ(std::get<TablePattern>(pixels.pattern).period_s, 0.05);

  const TemporaryFolder folder;
  std::ofstream(folder / "pulses.csv") << "time_s,azimuth_deg,elevation_deg\n0,0,0\n0.01,1,2\n";
  const std::string table = with_pattern("table: {csv: pulses.csv, period_s: 0.1}\n");
  EXPECT_EQ(std::get<TablePattern>(parse_lidar(table, folder / "a.yaml").pattern).shots.size(), 2u);
  EXPECT_THAT([&] { parse_lidar(table, "elsewhere/a.yaml"); },
              ThrowsMessage<Error>(HasSubstr("elsewhere/pulses.csv")));
  EXPECT_THAT([&] { parse_lidar(table + "rotation: {}\n", folder / "a.yaml"); },
              ThrowsMessage<Error>(HasSubstr("has several patterns")));
}

TEST(LidarFile, ReadsLoopsAndAFieldOfView) {
  const LidarSpec lidar = parse_lidar(
      with(with(with(with(lidar_text, "[ring,", "[loop, ring,"), "[1, -30", "[0, 1, -30"),
                "[0, +3.0e1", "[1, 0, +3.0e1"),
           "start_azimuth_deg: 180", "start_azimuth_deg: 180\n  field_of_view_deg: [-90, 45]"),
      "a.yaml");
  EXPECT_EQ(spinning(lidar).beams[0].loop, 0);
  EXPECT_EQ(spinning(lidar).beams[1].loop, 1);
  ASSERT_TRUE(spinning(lidar).field_of_view);
  EXPECT_DOUBLE_EQ(spinning(lidar).field_of_view->from_rad, glm::radians(-90.));
  EXPECT_DOUBLE_EQ(spinning(lidar).field_of_view->to_rad, glm::radians(45.));
}

}  // namespace
}  // namespace groundray::lidar_reader_test
