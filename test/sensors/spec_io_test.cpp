#include "sensors/spec_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>

#include "core/error.h"
#include "sensors/lidar.h"
#include "test/support/temporary_folder.h"

namespace groundray {
namespace {

using groundray::testing::data_folder;
using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

constexpr const char* scene_text = R"(groundray: 1
seed: 18446744073709551615
duration_s: 1.5
tracing: exact
terrain:
  dem: ../terrain/prairie.tif
  nodata: -32767
  reproject_to: utm
  label: 40
platform:
  drive:
    waypoints_m: [[0, 0], [40, 10.5]]
    speed_m_s: 20
    height_m: 0.4
    footprint_m: [2.5, 1.6]
lidars:
  - name: top
    preset: velodyne_vlp16
    mount:
      translation_m: [1, 0, 1.6]
      yaw_deg: 90
    rate_hz: 20
    range_gate_m: [0.4, 50]
    range_noise_sigma_m: 0.02
)";

constexpr const char* lidar_text = R"(groundray_lidar: 1
model: Two beams
rotation:
  rate_hz: 10
  sense: counter_clockwise
  start_azimuth_deg: 180
firing_period_us: 100
range_gate_m:
  near: 0.3
beam_columns: [ring, elevation_deg, azimuth_offset_deg, origin_z_m, firing_time_us]
beams:
  - [1, -30, 2, 0.01, 0]
  - [0, +3.0e1, -2, 0, 50]
sources:
  beams: a made-up lidar
)";

// Returns `text` with the first `old` replaced; both must hold whole lines for the line numbers to
// stay.
std::string with(std::string text, std::string_view old, std::string_view fresh) {
  const auto place = text.find(old);
  if (place == std::string::npos) throw std::logic_error("no such text: " + std::string(old));
  return text.replace(place, old.size(), fresh);
}

const SpinningPattern& spinning(const LidarSpec& lidar) {
  return std::get<SpinningPattern>(lidar.pattern);
}

SceneSpec parse(const std::string& text) {
  return parse_scene(text, "scenes/prairie.yaml", data_folder() / "sensors");
}

// What parse_scene says of the scene above with one text replaced.
std::string complaint(std::string_view old, std::string_view fresh) {
  try {
    parse(with(scene_text, old, fresh));
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

std::string lidar_complaint(std::string_view old, std::string_view fresh) {
  try {
    parse_lidar(with(lidar_text, old, fresh), "mine.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(SceneFile, ReadsEveryKey) {
  const SceneSpec scene = parse(scene_text);
  EXPECT_EQ(scene.text, scene_text);
  EXPECT_EQ(scene.seed.value, 18446744073709551615u);
  EXPECT_EQ(scene.duration_s, 1.5);
  EXPECT_EQ(scene.tracing, Tracing::Exact);
  EXPECT_EQ(scene.terrain.dem, "terrain/prairie.tif");
  EXPECT_EQ(scene.terrain.options.nodata, -32767);
  EXPECT_EQ(scene.terrain.options.reproject_to, "utm");
  EXPECT_EQ(scene.terrain.label, 40);
  const auto& drive = std::get<DrivenPath>(scene.platform);
  EXPECT_THAT(drive.waypoints_m, ::testing::ElementsAre(glm::dvec2(0, 0), glm::dvec2(40, 10.5)));
  EXPECT_EQ(drive.speed_m_s, 20);
  EXPECT_EQ(drive.height_m, 0.4);
  EXPECT_EQ(drive.footprint_m, glm::dvec2(2.5, 1.6));
  ASSERT_EQ(scene.lidars.size(), 1u);
  const MountedLidar& top = scene.lidars[0];
  EXPECT_EQ(top.name, "top");
  EXPECT_EQ(top.source, "velodyne_vlp16");
  EXPECT_EQ(top.lidar.model, "Velodyne VLP-16 (Puck)");
  EXPECT_EQ(spinning(top.lidar).rate_hz, 20);
  EXPECT_EQ(top.lidar.gate.near_m, 0.4);
  EXPECT_EQ(top.lidar.gate.far_m, 50);
  EXPECT_EQ(top.lidar.range_noise_sigma_m, 0.02);
  EXPECT_EQ(top.X_BS.translation_m, glm::dvec3(1, 0, 1.6));
  const glm::dvec3 forward = top.X_BS.rotation * glm::dvec3(1, 0, 0);  // yaw 90 looks to the left
  EXPECT_NEAR(forward.x, 0, 1e-15);
  EXPECT_NEAR(forward.y, 1, 1e-15);
}

TEST(SceneFile, ReadsHowFinelyTerrainIsTraced) {
  const std::string text =
      with(with(scene_text, "label: 40",
                "label: 40\n  tolerance_m: 0.05\n  tolerance_mrad: 0.3\n  memory_mib: 512"),
           "range_noise_sigma_m", "error_bound: report\n    range_noise_sigma_m");
  const SceneSpec scene = parse(text);
  EXPECT_EQ(scene.terrain.detail.tolerance_m, 0.05);
  EXPECT_EQ(scene.terrain.detail.tolerance_rad, 0.3e-3);
  EXPECT_EQ(scene.terrain.detail.memory_mib, 512u);
  EXPECT_EQ(scene.lidars[0].lidar.error_bound, LidarSpec::ErrorBound::Report);
  EXPECT_THAT(complaint("label: 40", "tolerance_m: -1"), HasSubstr("key 'tolerance_m': is -1"));
  EXPECT_THAT(complaint("label: 40", "memory_mib: 5000000000"), HasSubstr("key 'memory_mib'"));
}

TEST(SceneFile, FillsInWhatIsOptional) {
  const SceneSpec scene = parse(R"(
groundray: 1
seed: 0
duration_s: 1
terrain: {dem: /data/dem.tif}
platform: {trajectory: path.tum}
lidars: [{name: a, preset: hesai_xt32, mount: {}}]
)");
  EXPECT_EQ(scene.tracing, Tracing::Fast);
  EXPECT_EQ(scene.terrain.dem, "/data/dem.tif");
  EXPECT_EQ(scene.terrain.options.nodata, std::nullopt);
  EXPECT_EQ(scene.terrain.options.reproject_to, "");
  EXPECT_EQ(scene.terrain.label, 1);
  EXPECT_EQ(std::get<RecordedPath>(scene.platform).tum, "scenes/path.tum");
  EXPECT_EQ(scene.lidars[0].X_BS, Pose{});
  EXPECT_EQ(spinning(scene.lidars[0].lidar).rate_hz, 10);
  EXPECT_EQ(scene.lidars[0].lidar.range_noise_sigma_m, 0);
}

TEST(SceneFile, FindsALidarFileBesideTheScene) {
  const TemporaryFolder folder;
  std::ofstream(folder / "mine.yaml") << lidar_text;
  std::ofstream(folder / "scene.yaml")
      << with(scene_text, "preset: velodyne_vlp16", "file: mine.yaml");
  const SceneSpec scene = load_scene(folder / "scene.yaml", folder / "there_is_no_preset_folder");
  EXPECT_EQ(scene.lidars[0].lidar.model, "Two beams");
  EXPECT_EQ(scene.lidars[0].source, "mine.yaml");
}

TEST(SceneFile, ListsAllItsFaultsInTheOrderOfTheFile) {
  const std::string text = with(with(scene_text, "duration_s: 1.5", "duration_s: -1"),
                                "speed_m_s: 20", "speed_km_h: 20");
  EXPECT_THAT(
      [&] { parse(with(text, "rate_hz: 20", "rate_hz: often")); },
      ThrowsMessage<Error>(
          "scenes/prairie.yaml:3:13: key 'duration_s': is -1, but must be > 0 and at most 1e6\n"
          "scenes/prairie.yaml:13:5: key 'speed_km_h': unknown; did you mean 'speed_m_s'?\n"
          "scenes/prairie.yaml:22:14: key 'rate_hz': is 'often', but must be a number: write it "
          "bare, in the "
          "unit of the key"));
}

TEST(SceneFile, CountsFaultsBeyond200) {
  std::string text;
  for (int i = 0; i < 250; ++i) text += "nonsense" + std::to_string(i) + ": 1\n";
  EXPECT_THAT([&] { parse(text); },  // 250 unknown keys and six missing ones
              ThrowsMessage<Error>(AllOf(HasSubstr(":194:1: key 'nonsense193': unknown"),
                                         ::testing::EndsWith("\n... and 56 more"))));
}

TEST(SceneFile, SuggestsTheKeyThatWasMeant) {
  EXPECT_THAT(complaint("range_gate_m", "range_gate_km"),
              HasSubstr(":23:5: key 'range_gate_km': unknown; did you mean 'range_gate_m'?"));
  EXPECT_THAT(complaint("tracing", "tracng"),
              HasSubstr(":4:1: key 'tracng': unknown; did you mean 'tracing'?"));
  EXPECT_THAT(complaint("yaw_deg: 90", "yaw: 90"),
              HasSubstr(":21:7: key 'yaw': unknown; did you mean 'yaw_deg'?"));
  EXPECT_THAT(complaint("label: 40", "colour: 40"),
              ::testing::EndsWith(":9:3: key 'colour': unknown"));
}

TEST(SceneFile, NamesAMisspeltKeyOnceAndNotAsMissingToo) {
  EXPECT_THAT(complaint("dem:", "dme:"),
              AllOf(HasSubstr("did you mean 'dem'?"), Not(HasSubstr("missing"))));
}

TEST(SceneFile, RefusesMissingAndRepeatedKeys) {
  EXPECT_THAT(complaint("seed: 18446744073709551615\n", ""),
              HasSubstr("prairie.yaml:1:1: key 'seed': missing"));
  EXPECT_THAT(complaint("label: 40", "dem: other.tif"),
              HasSubstr(":9:3: key 'dem': repeated; it was given in line 6"));
}

TEST(SceneFile, RefusesValuesOfTheWrongType) {
  EXPECT_THAT(complaint("speed_m_s: 20", "speed_m_s: 20 m/s"),
              HasSubstr(":13:16: key 'speed_m_s': is '20 m/s', but must be a number"));
  EXPECT_THAT(complaint("speed_m_s: 20", "speed_m_s: '20'"),
              HasSubstr(":13:16: key 'speed_m_s': is '20', but must be a number"));
  EXPECT_THAT(complaint("speed_m_s: 20", "speed_m_s:"),
              HasSubstr(":13:5: key 'speed_m_s': is empty, but must be a number"));
  EXPECT_THAT(complaint("yaw_deg: 90", "yaw_deg: [90]"),
              HasSubstr(":21:16: key 'yaw_deg': is a list of 1, but must be a number"));
  EXPECT_THAT(
      complaint("[1, 0, 1.6]", "[1, 0]"),
      HasSubstr(":20:22: key 'translation_m': is a list of 2, but must be a list of 3 numbers"));
  EXPECT_THAT(complaint("[40, 10.5]", "[40, north]"),
              HasSubstr(":12:32: key 'waypoints_m': is 'north', but must be a number"));
  EXPECT_THAT(
      complaint("platform:\n", "platform: []\nold:\n"),
      HasSubstr(":10:11: key 'platform': is a list of 0, but must be a map of keys and values"));
  EXPECT_THAT(complaint("dem: ../terrain/prairie.tif", "dem: {file: a.tif}"),
              HasSubstr(":6:8: key 'dem': is a map, but must be a text"));
}

TEST(SceneFile, RefusesNumbersThatAreNotFinite) {
  for (const char* number : {".nan", ".inf", "-.INF", "1e999"}) {
    EXPECT_THAT(complaint("height_m: 0.4", std::string("height_m: ") + number),
                HasSubstr(":14:15: key 'height_m': is '" + std::string(number) +
                          "', but must be a finite number"));
  }
}

TEST(SceneFile, RefusesValuesOutOfRange) {
  EXPECT_THAT(complaint("groundray: 1", "groundray: 2"),
              HasSubstr(":1:12: key 'groundray': is 2, but this groundray reads format 1 alone"));
  EXPECT_THAT(complaint("seed: 18446744073709551615", "seed: 18446744073709551616"),
              HasSubstr(":2:7: key 'seed': is '18446744073709551616', but must be a whole number "
                        "from 0 to 18446744073709551615"));
  EXPECT_THAT(
      complaint("label: 40", "label: 65536"),
      HasSubstr(":9:10: key 'label': is '65536', but must be a whole number from 0 to 65535"));
  EXPECT_THAT(complaint("[2.5, 1.6]", "[2.5, 0]"),
              HasSubstr(":15:24: key 'footprint_m': is 0, but must be > 0"));
  EXPECT_THAT(complaint("[[0, 0], [40, 10.5]]", "[[0, 0]]"),
              HasSubstr(":12:18: key 'waypoints_m': has 1 points, but a drive needs at least two"));
  EXPECT_THAT(
      complaint("[0.4, 50]", "[50, 0.4]"),
      HasSubstr(":23:19: key 'range_gate_m': [50, 0.4] is empty: are near and far swapped?"));
  EXPECT_THAT(complaint("sigma_m: 0.02", "sigma_m: -0.02"),
              HasSubstr(":24:26: key 'range_noise_sigma_m': is -0.02, but must be >= 0"));
  EXPECT_THAT(complaint("rate_hz: 20", "rate_hz: 20000"),
              HasSubstr(":22:14: key 'rate_hz': makes 0.904225 firing sequences in a turn"));
  EXPECT_THAT(complaint("tracing: exact", "tracing: exakt"),
              HasSubstr(":4:10: key 'tracing': is 'exakt', but must be one of fast, exact; did you "
                        "mean 'exact'?"));
}

TEST(SceneFile, RefusesAnUnknownPresetAndListsTheKnown) {
  EXPECT_THAT(complaint("velodyne_vlp16", "velodyne_vlp-16"),
              AllOf(HasSubstr(":18:13: key 'preset': 'velodyne_vlp-16' is not in "),
                    HasSubstr("did you mean 'velodyne_vlp16'?; it has hesai_pandar64, hesai_qt128, "
                              "hesai_xt32, ouster_os0_128")));
}

TEST(SceneFile, TakesExactlyOnePathAndOneLidarSource) {
  EXPECT_THAT(
      complaint("platform:\n", "platform:\n  trajectory: path.tum\n"),
      HasSubstr(":11:3: key 'platform': must have exactly one of 'trajectory' and 'drive'"));
  EXPECT_THAT(complaint("preset: velodyne_vlp16", "file: mine.yaml\n    preset: velodyne_vlp16"),
              HasSubstr(":17:5: key 'lidars': must have exactly one of 'preset' and 'file'"));
}

TEST(SceneFile, NamesEachLidarOnceAndForAFile) {
  EXPECT_THAT(complaint("name: top", "name: to/p"),
              HasSubstr(":17:11: key 'name': is 'to/p', but names files"));
  EXPECT_THAT(complaint("lidars:\n", "lidars:\n  - {name: top, preset: hesai_xt32, mount: {}}\n"),
              HasSubstr(":18:5: key 'name': 'top' is taken by an earlier lidar"));
}

TEST(SceneFile, NeedsALidar) {
  EXPECT_THAT([] { parse("groundray: 1\nlidars: []\n"); },
              ThrowsMessage<Error>(HasSubstr(":2:9: key 'lidars': is an empty list")));
}

TEST(SceneFile, PassesOnTheFaultsOfALidarFile) {
  const TemporaryFolder folder;
  std::ofstream(folder / "mine.yaml") << with(lidar_text, "rate_hz: 10", "rate_hz: 0");
  EXPECT_THAT(
      [&] {
        parse_scene(with(scene_text, "preset: velodyne_vlp16", "file: mine.yaml"),
                    folder / "scene.yaml", "");
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("scene.yaml:18:11: key 'file': the lidar cannot be read:\n"),
                HasSubstr("mine.yaml:4:12: key 'rate_hz': is 0, but must be > 0"))));
}

TEST(SceneFile, RefusesWhatIsNotYaml) {
  EXPECT_THAT(complaint("[[0, 0], [40, 10.5]]", "[[0, 0], [40, 10.5]"),
              AllOf(StartsWith("scenes/prairie.yaml:"), HasSubstr(": not YAML: ")));
  EXPECT_THAT(complaint("seed:", "seed: : :"), StartsWith("scenes/prairie.yaml:2:"));
  EXPECT_THAT([] { parse("# nothing\n"); },
              ThrowsMessage<Error>("scenes/prairie.yaml:1:1: the file is empty"));
  EXPECT_THAT([] { parse("just a text"); },
              ThrowsMessage<Error>(
                  HasSubstr("scenes/prairie.yaml:1:1: is 'just a text', but must be a map")));
  EXPECT_THAT([] { parse(std::string(scene_text) + "---\nseed: 1\n"); },
              ThrowsMessage<Error>(HasSubstr(":26:1: a second document begins")));
}

TEST(SceneFile, RefusesBombsOfAliasesAndDepth) {
  EXPECT_THAT([] { parse("a: &a [1]\nb: [*a, *a]\n"); },
              ThrowsMessage<Error>(
                  HasSubstr("scenes/prairie.yaml:2:5: aliases (*name) are not allowed here")));
  EXPECT_THAT([] { parse(std::string(33, '[') + std::string(33, ']')); },
              ThrowsMessage<Error>(HasSubstr("scenes/prairie.yaml:1:33: nested deeper")));
  EXPECT_THAT([] { parse(std::string(100'000, '[')); },
              ThrowsMessage<Error>(HasSubstr("nested deeper")));
  std::string steps;
  for (std::size_t i = 0; i < 1000; ++i) steps += std::string(i, ' ') + "a:\n";
  EXPECT_THAT([&] { parse(steps); }, ThrowsMessage<Error>(HasSubstr("nested deeper")));
}

TEST(SceneFile, ThatIsNotThereIsNamed) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { load_scene(folder / "none.yaml", ""); },
              ThrowsMessage<Error>(HasSubstr("none.yaml: there is no such file")));
  EXPECT_THAT([&] { load_scene(folder.path(), ""); },
              ThrowsMessage<Error>(HasSubstr("there is no such file")));
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

TEST(LidarFile, RefusesBeamsThatDoNotFitTheirColumns) {
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

TEST(LidarFile, RefusesColumnsThatAreUnknownMissingOrRepeated) {
  EXPECT_THAT(lidar_complaint("elevation_deg", "elevation_rad"),
              HasSubstr(":10:22: key 'beam_columns': 'elevation_rad' is not a column of beams; did "
                        "you mean 'elevation_deg'?"));
  EXPECT_THAT(lidar_complaint("firing_time_us]", "origin_x_m]"),
              HasSubstr(":10:15: key 'beam_columns': lacks firing_time_us"));
  EXPECT_THAT(lidar_complaint("firing_time_us]", "ring]"),
              HasSubstr("key 'beam_columns': 'ring' is repeated"));
}

TEST(LidarFile, RefusesValuesOutOfRange) {
  EXPECT_THAT(
      lidar_complaint("counter_clockwise", "ccw"),
      HasSubstr(":5:10: key 'sense': is 'ccw', but must be one of clockwise, counter_clockwise"));
  EXPECT_THAT(lidar_complaint("firing_period_us: 100", "firing_period_us: 1e-9"),
              HasSubstr(":7:19: key 'firing_period_us': makes 1e+14 firing sequences in a turn, "
                        "but must make 1 to 1000000"));
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

TEST(LidarFile, RefusesPhysicsThatDoesNotGoTogether) {
  const std::string text =
      with(std::string(lidar_text) + physics_text, "  threshold_w: 1e-8\n", "");
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
  EXPECT_THAT(physics_complaint("  pulse_shape: [0, 1, 3, 2, 0]\n  pulse_shape_step_ns: 1.5\n", ""),
              HasSubstr("fwhm"));
}

TEST(LidarFile, NeedsLaserAndReceiverTogether) {
  EXPECT_THAT(
      lidar_complaint("sources:", "laser: {wavelength_nm: 905, pulse_energy_nj: 1}\nsources:"),
      HasSubstr("key 'laser': needs 'receiver' beside it"));
}

// A lidar file with another pattern than a spinning head's.
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

constexpr const char* scene_physics =
    R"(    laser: {wavelength_nm: 905, pulse_energy_nj: 100, pulse_fwhm_ns: 5}
    receiver: {aperture_mm: 25, threshold_w: 1e-9}
    no_returns: report
    waveforms: keep
    points: at_stamp
)";

TEST(SceneFile, GivesALidarLight) {
  const std::string text = with(scene_text, "label: 40", "label: 40\n  material: dry_soil") +
                           scene_physics +
                           "weather: {visibility_m: 800, haze_law: kruse, rain_mm_h: 3, "
                           "group_index: 1.00027}\n";
  const SceneSpec scene = parse(text);
  ASSERT_TRUE(scene.terrain.material);
  EXPECT_EQ(scene.terrain.material->name, "dry_soil");
  EXPECT_EQ(scene.air.visibility_m, 800);
  EXPECT_EQ(scene.air.haze_law, HazeLaw::Kruse);
  EXPECT_EQ(scene.air.rain_mm_h, 3);
  EXPECT_EQ(scene.air.group_index, 1.00027);
  const LidarSpec& lidar = scene.lidars[0].lidar;
  ASSERT_TRUE(lidar.light);
  EXPECT_EQ(lidar.light->wavelength_nm, 905);
  EXPECT_EQ(lidar.no_returns, LidarSpec::NoReturns::Report);
  EXPECT_EQ(lidar.waveforms, LidarSpec::WaveformOutput::Keep);
  EXPECT_EQ(lidar.points, LidarSpec::Points::AtStamp);
}

std::string scene_complaint(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(SceneFile, NeedsAMaterialForALaserAndAnOverlapForFog) {
  const std::string text = std::string(scene_text) + scene_physics;
  EXPECT_THAT(scene_complaint(text), HasSubstr("key 'terrain': must name a material"));
  const std::string soil = with(text, "label: 40", "label: 40\n  material: dry_soil");
  EXPECT_EQ(scene_complaint(soil), "no complaint");
  EXPECT_THAT(scene_complaint(soil + "weather: {fog_range_m: 100}\n"),
              HasSubstr("the receiver of 'top' needs overlap_m"));
  EXPECT_THAT(scene_complaint(with(text, "label: 40", "label: 40\n  material: dry_sol")),
              AllOf(HasSubstr("key 'material': 'dry_sol' is not in "),
                    HasSubstr("did you mean 'dry_soil'?")));
}

TEST(SceneFile, LaysAUnitsCalibrationOverAPreset) {
  const TemporaryFolder folder;
  std::ofstream(folder / "mine.yaml") << lidar_text;
  std::ofstream(folder / "unit.csv") << "Channel,Elevation,Azimuth\n1,7,-3\n2,-8,4\n";
  const std::string text = with(with(scene_text, "preset: velodyne_vlp16", "file: mine.yaml"),
                                "mount:", "calibration: unit.csv\n    mount:");
  const SceneSpec scene = parse_scene(text, folder / "scene.yaml", data_folder() / "sensors");
  const auto& beams = spinning(scene.lidars[0].lidar).beams;
  EXPECT_DOUBLE_EQ(beams[0].elevation_rad, glm::radians(7.));
  EXPECT_DOUBLE_EQ(beams[1].azimuth_offset_rad, glm::radians(-4.));
  EXPECT_DOUBLE_EQ(beams[1].firing_time_s, 50e-6);
  EXPECT_THAT(complaint("mount:", "calibration: none.csv\n    mount:"),
              HasSubstr("key 'calibration': the unit cannot be read:"));
}

TEST(PresetNames, AreSortedAndWithoutExtension) {
  const TemporaryFolder folder;
  for (const char* name : {"b.yaml", "a.yaml", "notes.txt"}) std::ofstream(folder / name) << "x";
  EXPECT_THAT(preset_names(folder.path()), ::testing::ElementsAre("a", "b"));
  EXPECT_THAT([&] { preset_names(folder / "none"); },
              ThrowsMessage<Error>(HasSubstr("none: the folder of presets cannot be read")));
}

}  // namespace
}  // namespace groundray
