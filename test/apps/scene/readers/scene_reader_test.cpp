#include "apps/scene/readers/scene_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <numbers>
#include <string>

#include "core/error.h"
#include "sensors/sky/sun.h"
#include "test/support/scans/lidar_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::scene_reader_test {
namespace {

using groundray::testing::data_folder;
using groundray::testing::lidar_text;
using groundray::testing::spinning;
using groundray::testing::TemporaryFolder;
using groundray::testing::with;
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

SceneSpec parse(const std::string& text) {
  return parse_scene(text, "scenes/prairie.yaml", data_folder() / "sensors");
}

// Error message of parse_scene for the scene above with one text replaced.
std::string complaint(std::string_view old, std::string_view fresh) {
  try {
    parse(with(scene_text, old, fresh));
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

TEST(SceneFile, ReadsTheTolerancesOfTerrain) {
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

TEST(SceneFile, HasDefaultsForOptionalKeys) {
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

TEST(SceneFile, ErrorListsFaultsInTheOrderOfTheFile) {
  const std::string text = with(with(scene_text, "duration_s: 1.5", "duration_s: -1"),
                                "speed_m_s: 20", "speed_km_h: 20");
  EXPECT_THAT(
      [&] { parse(with(text, "rate_hz: 20", "rate_hz: often")); },
      ThrowsMessage<Error>(
          "scenes/prairie.yaml:3:13: key 'duration_s': is -1, but must be > 0 and at most 1e5\n"
          "scenes/prairie.yaml:13:5: key 'speed_km_h': unknown; did you mean 'speed_m_s'?\n"
          "scenes/prairie.yaml:22:14: key 'rate_hz': is 'often', but must be a number: write it "
          "without quotes or unit, in the unit of the key"));
}

TEST(SceneFile, CountsFaultsBeyond200) {
  std::string text;
  for (int i = 0; i < 250; ++i) text += "nonsense" + std::to_string(i) + ": 1\n";
  EXPECT_THAT([&] { parse(text); },  // 250 unknown keys and six missing ones
              ThrowsMessage<Error>(AllOf(HasSubstr(":194:1: key 'nonsense193': unknown"),
                                         ::testing::EndsWith("\n... and 56 more"))));
}

TEST(SceneFile, SuggestsTheClosestKey) {
  EXPECT_THAT(complaint("range_gate_m", "range_gate_km"),
              HasSubstr(":23:5: key 'range_gate_km': unknown; did you mean 'range_gate_m'?"));
  EXPECT_THAT(complaint("tracing", "tracng"),
              HasSubstr(":4:1: key 'tracng': unknown; did you mean 'tracing'?"));
  EXPECT_THAT(complaint("yaw_deg: 90", "yaw: 90"),
              HasSubstr(":21:7: key 'yaw': unknown; did you mean 'yaw_deg'?"));
  EXPECT_THAT(
      complaint("label: 40", "hue: 40"),
      HasSubstr(":9:3: key 'hue': unknown; the keys here are canopy, cover, dem, erosion, label,"));
}

TEST(SceneFile, ReportsAMisspeltKeyOnceAndNotAsMissing) {
  EXPECT_THAT(complaint("dem:", "dme:"),
              AllOf(HasSubstr("did you mean 'dem'?"), Not(HasSubstr("missing"))));
}

TEST(SceneFile, RejectsMissingAndRepeatedKeys) {
  EXPECT_THAT(complaint("seed: 18446744073709551615\n", ""),
              HasSubstr("prairie.yaml:1:1: key 'seed': missing"));
  EXPECT_THAT(complaint("label: 40", "dem: other.tif"),
              HasSubstr(":9:3: key 'dem': repeated; first given in line 6"));
}

TEST(SceneFile, RejectsValuesOfTheWrongType) {
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

TEST(SceneFile, RejectsNonFiniteNumbers) {
  for (const char* number : {".nan", ".inf", "-.INF", "1e999"}) {
    EXPECT_THAT(complaint("height_m: 0.4", std::string("height_m: ") + number),
                HasSubstr(":14:15: key 'height_m': is '" + std::string(number) +
                          "', but must be a finite number"));
  }
}

TEST(SceneFile, RejectsValuesOutOfRange) {
  EXPECT_THAT(
      complaint("groundray: 1", "groundray: 2"),
      HasSubstr(":1:12: key 'groundray': is 2, but this version of groundray reads only format 1"));
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
              HasSubstr(":22:14: key 'rate_hz': yields 0.904225 firing sequences per turn"));
  EXPECT_THAT(complaint("tracing: exact", "tracing: exakt"),
              HasSubstr(":4:10: key 'tracing': is 'exakt', but must be one of fast, exact; did you "
                        "mean 'exact'?"));
}

TEST(SceneFile, RejectsAnUnknownPresetAndListsThePresets) {
  EXPECT_THAT(complaint("velodyne_vlp16", "velodyne_vlp-16"),
              AllOf(HasSubstr(":18:13: key 'preset': 'velodyne_vlp-16' is not in "),
                    HasSubstr("which has hesai_pandar64, hesai_qt128, hesai_xt32, ouster_os0_128"),
                    HasSubstr("did you mean 'velodyne_vlp16'?")));
}

TEST(SceneFile, RequiresExactlyOnePathAndOneLidarSource) {
  EXPECT_THAT(
      complaint("platform:\n", "platform:\n  trajectory: path.tum\n"),
      HasSubstr(":11:3: key 'platform': must have exactly one of 'trajectory' and 'drive'"));
  EXPECT_THAT(complaint("preset: velodyne_vlp16", "file: mine.yaml\n    preset: velodyne_vlp16"),
              HasSubstr(":17:5: key 'lidars': must have exactly one of 'preset' and 'file'"));
}

TEST(SceneFile, RejectsRepeatedLidarNamesAndPathSeparators) {
  EXPECT_THAT(complaint("name: top", "name: to/p"),
              HasSubstr(":17:11: key 'name': is 'to/p', but is used in file names"));
  EXPECT_THAT(complaint("lidars:\n", "lidars:\n  - {name: top, preset: hesai_xt32, mount: {}}\n"),
              HasSubstr(":18:5: key 'name': 'top' is taken by an earlier lidar"));
}

TEST(SceneFile, RequiresALidar) {
  EXPECT_THAT([] { parse("groundray: 1\nlidars: []\n"); },
              ThrowsMessage<Error>(HasSubstr(":2:9: key 'lidars': is an empty list")));
}

TEST(SceneFile, ReportsTheFaultsOfALidarFile) {
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

TEST(SceneFile, RejectsInvalidYaml) {
  EXPECT_THAT(complaint("[[0, 0], [40, 10.5]]", "[[0, 0], [40, 10.5]"),
              StartsWith("scenes/prairie.yaml:12:18: this '[' is not closed"));
  EXPECT_THAT(complaint("seed:", "seed: : :"), StartsWith("scenes/prairie.yaml:2:"));
  EXPECT_THAT([] { parse("# nothing\n"); },
              ThrowsMessage<Error>("scenes/prairie.yaml:1:1: the file is empty"));
  EXPECT_THAT([] { parse("just a text"); },
              ThrowsMessage<Error>(
                  HasSubstr("scenes/prairie.yaml:1:1: is 'just a text', but must be a map")));
  EXPECT_THAT([] { parse(std::string(scene_text) + "---\nseed: 1\n"); },
              ThrowsMessage<Error>(HasSubstr(":26:1: a second document begins")));
}

TEST(SceneFile, RejectsAliasBombsAndDeepNesting) {
  EXPECT_THAT([] { parse("a: &a [1]\nb: [*a, *a]\n"); },
              ThrowsMessage<Error>(
                  HasSubstr("scenes/prairie.yaml:2:5: aliases (*name) are not allowed here")));
  EXPECT_THAT([] { parse(std::string(33, '[') + std::string(33, ']')); },
              ThrowsMessage<Error>(HasSubstr("scenes/prairie.yaml:1:33: nested too deeply")));
  EXPECT_THAT([] { parse(std::string(100'000, '[')); },
              ThrowsMessage<Error>(HasSubstr("nested too deeply")));
  std::string steps;
  for (std::size_t i = 0; i < 1000; ++i) steps += std::string(i, ' ') + "a:\n";
  EXPECT_THAT([&] { parse(steps); }, ThrowsMessage<Error>(HasSubstr("nested too deeply")));
}

TEST(SceneFile, ReportsAMissingFile) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { load_scene(folder / "none.yaml", ""); },
              ThrowsMessage<Error>(HasSubstr("none.yaml: there is no such file")));
  EXPECT_THAT([&] { load_scene(folder.path(), ""); },
              ThrowsMessage<Error>(HasSubstr("it is a folder, but must be a file")));
}

constexpr const char* scene_physics =
    R"(    laser: {wavelength_nm: 905, pulse_energy_nj: 100, pulse_fwhm_ns: 5}
    receiver: {aperture_mm: 25, threshold_w: 1e-9}
    no_returns: report
    waveforms: keep
    points: at_stamp
)";

TEST(SceneFile, ReadsMaterialWeatherAndLight) {
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

TEST(SceneFile, RequiresAMaterialForALaserAndAnOverlapForFog) {
  const std::string text = std::string(scene_text) + scene_physics;
  EXPECT_THAT(scene_complaint(text), HasSubstr("key 'terrain': must have a material"));
  const std::string soil = with(text, "label: 40", "label: 40\n  material: dry_soil");
  EXPECT_EQ(scene_complaint(soil), "no complaint");
  EXPECT_THAT(scene_complaint(soil + "weather: {fog_range_m: 100}\n"),
              HasSubstr("the receiver of 'top' needs overlap_m"));
  EXPECT_THAT(scene_complaint(with(soil, ", pulse_fwhm_ns: 5", "")),
              HasSubstr("key 'lidars': 'top' is invalid: pulse"));
  EXPECT_THAT(scene_complaint(with(soil, "wavelength_nm: 905", "wavelength_nm: 2400")),
              HasSubstr("key 'wavelength_nm': is 2400, but must be from 400 to 2000"));
  EXPECT_THAT(scene_complaint(with(text, "label: 40", "label: 40\n  material: dry_sol")),
              AllOf(HasSubstr("key 'material': 'dry_sol' is not in "),
                    HasSubstr("did you mean 'dry_soil'?")));
}

TEST(SceneFile, AppliesAUnitsCalibrationToAPreset) {
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
              HasSubstr("key 'calibration': the calibration cannot be read:"));
}

TEST(PresetNames, AreSortedAndWithoutExtension) {
  const TemporaryFolder folder;
  for (const char* name : {"b.yaml", "a.yaml", "notes.txt"}) std::ofstream(folder / name) << "x";
  EXPECT_THAT(preset_names(folder.path()), ::testing::ElementsAre("a", "b"));
  EXPECT_THAT([&] { preset_names(folder / "none"); },
              ThrowsMessage<Error>(HasSubstr("none: the folder of presets cannot be read")));
}

constexpr const char* covered =
    R"(label: 40
  material: dry_soil
  texture: {albedo: soil.png, size_m: 2}
  orthophoto: /maps/photo.tif
  cover:
    - material: gravel
      label: 41
      slope_deg: [20, 90]
      slope_blend_deg: 5
    - material: dry_grass
      height_m: [100, 200]
      height_blend_m: 10
      mask: grass.tif
      mask_full: 255
      mask_nodata: 7
      texture: {normal: blades.png, size_m: 0.5})";

TEST(SceneFile, ReadsTheLayersOfTheGround) {
  const TerrainSpec terrain = parse(with(scene_text, "label: 40", covered)).terrain;
  ASSERT_TRUE(terrain.texture);
  EXPECT_EQ(terrain.texture->albedo.filename(), "soil.png");
  EXPECT_TRUE(terrain.texture->normal.empty());
  EXPECT_EQ(terrain.texture->size_m, 2);
  EXPECT_EQ(terrain.orthophoto, "/maps/photo.tif");
  ASSERT_EQ(terrain.cover.size(), 2u);
  const CoverSpec &gravel = terrain.cover[0], &grass = terrain.cover[1];
  EXPECT_EQ(gravel.material->name, "gravel");
  EXPECT_EQ(gravel.label, 41);
  EXPECT_NEAR(gravel.slope_rad.low, 0.349066, 1e-6);
  EXPECT_TRUE(std::isinf(gravel.slope_rad.high));  // no slope is steeper than 90 degrees
  EXPECT_NEAR(gravel.slope_rad.blend, 0.0872665, 1e-6);
  EXPECT_TRUE(gravel.mask.empty());
  EXPECT_EQ(grass.label, std::nullopt);
  EXPECT_EQ(grass.height_m.low, 100);
  EXPECT_EQ(grass.height_m.high, 200);
  EXPECT_EQ(grass.height_m.blend, 10);
  EXPECT_EQ(grass.mask.filename(), "grass.tif");
  EXPECT_EQ(grass.mask_full, 255);
  EXPECT_EQ(grass.mask_nodata, 7);
  EXPECT_EQ(grass.texture->normal.filename(), "blades.png");
}

TEST(SceneFile, ReportsFaultsInTheCover) {
  const auto complaint = [](const std::string& from, const std::string& to) {
    return scene_complaint(with(with(scene_text, "label: 40", covered), from, to));
  };
  EXPECT_THAT(complaint("material: gravel", "material: gravle"),
              HasSubstr("did you mean 'gravel'"));
  EXPECT_THAT(complaint("slope_deg: [20, 90]", "slope_deg: [20, 91]"),
              HasSubstr("must be from 0 to 90"));
  EXPECT_THAT(complaint("height_m: [100, 200]", "height_m: [200, 100]"),
              HasSubstr("key 'height_m': [200, 100] is empty"));
  EXPECT_THAT(complaint("slope_deg: [20, 90]", ""),
              HasSubstr("key 'slope_blend_deg': applies to 'slope_deg', which is missing"));
  EXPECT_THAT(complaint("mask: grass.tif", ""), HasSubstr("key 'mask_full': applies to 'mask'"));
  EXPECT_THAT(complaint("mask_full: 255", "mask_full: 0"), HasSubstr("must be > 0"));
  EXPECT_THAT(complaint("albedo: soil.png, ", ""),
              HasSubstr("key 'texture': must have 'albedo' or 'normal', or both"));
  std::string many = "label: 40\n  material: dry_soil\n  cover:\n";
  for (int i = 0; i < 8; ++i) many += "    - {material: gravel}\n";
  many.pop_back();
  EXPECT_THAT(scene_complaint(with(scene_text, "label: 40", many)),
              HasSubstr("key 'cover': has 8 layers, but must have at most 7"));
}

TEST(SceneFile, SunLightsLidars) {
  const std::string text = with(scene_text, "label: 40", "label: 40\n  material: dry_soil") +
                           scene_physics + "sky: {sun: {azimuth_deg: 90, elevation_deg: 30}}\n";
  const SolarBackground sun = parse(text).lidars[0].lidar.light->sun;
  ASSERT_TRUE(sun.irradiance_w_m2_nm);
  EXPECT_DOUBLE_EQ(*sun.irradiance_w_m2_nm,
                   direct_irradiance_w_m2_nm(905, 30 * std::numbers::pi / 180, {}));
  ASSERT_TRUE(sun.direction);
  EXPECT_NEAR(glm::distance(*sun.direction, glm::dvec3(std::sqrt(0.75), 0, 0.5)), 0, 1e-12);
  const std::string own = with(text, "threshold_w: 1e-9",
                               "response_fwhm_ns: 3, noise: {nep_w_per_sqrt_hz: 1e-12, "
                               "sun_w_m2_nm: 0.3}, threshold_w: 1e-9");
  EXPECT_EQ(parse(own).lidars[0].lidar.light->sun.irradiance_w_m2_nm, 0.3);
  EXPECT_FALSE(parse(own).lidars[0].lidar.light->sun.direction);
}

constexpr const char* scene_cameras =
    R"(cameras:
  - name: left
    preset: euroc_mav_cam0
    mount: {translation_m: [1, 0.1, 1.2], yaw_deg: 90}
    trigger: {lidar: top, delay_ms: 2.5}
    project: [top]
    shutter: {exposure_ms: 1}
    aperture: {f_number: 2, focal_length_mm: 2.8, focus_m: 4}
    sampling: {samples: 64}
    products: [truth, flow]
  - name: right
    preset: euroc_mav_cam1
    mount: {translation_m: [1, -0.1, 1.2]}
    trigger: {lidar: top, delay_ms: 2.5}
    products: [truth]
  - name: road
    preset: automotive_2mp3
    mount: {}
    rate_hz: 10
    first_ms: 20
    imager: {bits: 10, noise: off}
    picture: {bits: 16}
    products: [picture]
stereo:
  - {name: pair, left: left, right: right, images: rectified}
)";

std::string camera_scene() {
  return with(scene_text, "label: 40", "label: 40\n  material: dry_soil") + scene_cameras +
         "sky: {sun: {azimuth_deg: 90, elevation_deg: 30}}\n";
}

TEST(SceneFile, ReadsMountedCameras) {
  const SceneSpec scene = parse(camera_scene());
  ASSERT_EQ(scene.cameras.size(), 3u);
  const MountedCamera &left = scene.cameras[0], &road = scene.cameras[2];
  EXPECT_EQ(left.name, "left");
  EXPECT_EQ(left.source, "euroc_mav_cam0");
  EXPECT_THAT(left.text, HasSubstr("groundray_camera: 1"));
  EXPECT_EQ(left.camera.size_px, glm::ivec2(752, 480));
  EXPECT_EQ(left.camera.shutter.exposure_s, 1e-3);
  EXPECT_EQ(left.camera.aperture->focus_m, 4);
  EXPECT_EQ(left.camera.sampling.samples, 64);
  EXPECT_THAT(left.camera.products,
              ::testing::ElementsAre(CameraProduct::Truth, CameraProduct::Flow));
  ASSERT_TRUE(left.trigger);
  EXPECT_EQ(left.trigger->lidar, "top");
  EXPECT_DOUBLE_EQ(left.trigger->delay_s, 2.5e-3);
  EXPECT_THAT(left.lidars, ::testing::ElementsAre("top"));
  EXPECT_FALSE(road.trigger);
  EXPECT_EQ(road.camera.rate_hz, 10);
  EXPECT_DOUBLE_EQ(road.camera.first_s, 20e-3);
  EXPECT_EQ(road.camera.imager->bits, 10);
  EXPECT_FALSE(road.camera.imager->noise);
  EXPECT_EQ(road.camera.imager->black_dn, 168);  // from the preset
  EXPECT_EQ(road.camera.picture.bits, 16);
  ASSERT_EQ(scene.stereo.size(), 1u);
  EXPECT_EQ(scene.stereo[0].name, "pair");
  EXPECT_EQ(scene.stereo[0].left, "left");
  EXPECT_EQ(scene.stereo[0].right, "right");
  EXPECT_EQ(scene.stereo[0].images, StereoSpec::Images::Rectified);
}

// Expected axes of C in B: ahead is the mount's x, right its -y, down its -z.
TEST(SceneFile, CamerasPointAlongTheirMountsX) {
  const auto expect_axes = [](const Pose& X_BC, const glm::dvec3& right, const glm::dvec3& down,
                              const glm::dvec3& ahead) {
    const double tolerance = 1e-15;  // three roundings of quaternions of sines and cosines
    EXPECT_NEAR(glm::distance(X_BC.rotation * glm::dvec3(1, 0, 0), right), 0, tolerance);
    EXPECT_NEAR(glm::distance(X_BC.rotation * glm::dvec3(0, 1, 0), down), 0, tolerance);
    EXPECT_NEAR(glm::distance(X_BC.rotation * glm::dvec3(0, 0, 1), ahead), 0, tolerance);
  };
  const SceneSpec scene = parse(camera_scene());
  expect_axes(scene.cameras[1].X_BC, {0, -1, 0}, {0, 0, -1}, {1, 0, 0});
  expect_axes(scene.cameras[0].X_BC, {1, 0, 0}, {0, 0, -1}, {0, 1, 0});  // yaw 90: to the left
  EXPECT_EQ(scene.cameras[0].X_BC.translation_m, glm::dvec3(1, 0.1, 1.2));
}

TEST(SceneFile, RequiresNoLidarIfItHasACamera) {
  const std::string text = R"(groundray: 1
seed: 0
duration_s: 1
terrain: {dem: /data/dem.tif, material: dry_soil}
platform: {trajectory: path.tum}
cameras: [{name: a, preset: tum_vi_cam0, mount: {}, products: [truth]}]
)";
  EXPECT_EQ(parse(text).cameras.size(), 1u);
  EXPECT_THAT(scene_complaint(with(text, "cameras", "stereo")),
              HasSubstr("key 'lidars': missing, but a scene needs at least one lidar or camera"));
}

TEST(SceneFile, ReportsFaultsInCameras) {
  const auto complaint = [](std::string_view from, std::string_view to) {
    return scene_complaint(with(camera_scene(), from, to));
  };
  EXPECT_EQ(scene_complaint(camera_scene()), "no complaint");
  EXPECT_THAT(complaint("preset: automotive_2mp3", "preset: velodyne_vlp16"),
              AllOf(HasSubstr("key 'preset': the camera cannot be read:"),
                    HasSubstr("velodyne_vlp16.yaml:3:18: key 'groundray_lidar': this is a lidar, "
                              "not a camera: name it under 'lidars'")));
  EXPECT_THAT(complaint("preset: automotive_2mp3", "preset: automotive"),
              Not(HasSubstr("key 'full_well_e': missing")));
  EXPECT_THAT(complaint("preset: velodyne_vlp16", "preset: euroc_mav_cam0"),
              AllOf(HasSubstr("key 'preset': the lidar cannot be read:"),
                    HasSubstr("this is a camera, not a lidar: name it under 'cameras'")));
  EXPECT_THAT(complaint("preset: euroc_mav_cam1", "preset: euroc_cam1"),
              AllOf(HasSubstr("'euroc_cam1' is not in "),
                    HasSubstr("which has action_camera, automotive_2mp3, euroc_mav_cam0"),
                    Not(HasSubstr("velodyne"))));
  EXPECT_THAT(complaint("name: right", "name: top"),
              HasSubstr("key 'name': 'top' is taken by an earlier lidar: names must differ"));
  EXPECT_THAT(complaint("name: pair", "name: left"),
              HasSubstr("key 'name': 'left' is taken by an earlier camera"));
  EXPECT_THAT(complaint("lidar: top", "lidar: tpo"),
              HasSubstr("key 'lidar': is 'tpo', but the scene has the lidars top; did you mean"));
  EXPECT_THAT(complaint("project: [top]", "project: [left]"),
              HasSubstr("key 'project': is 'left', but the scene has the lidars top; that is a "
                        "camera"));
  EXPECT_THAT(complaint("project: [top]", "project: [top, top]"), HasSubstr("has 'top' twice"));
  EXPECT_THAT(complaint("    project", "    rate_hz: 5\n    project"),
              HasSubstr("key 'rate_hz': applies to cameras without 'trigger'"));
  EXPECT_THAT(complaint("exposure_ms: 1", "exposure_ms: 0"),
              HasSubstr("key 'exposure_ms': is 0, but must be > 0"));
  EXPECT_THAT(complaint("    first_ms: 20", "    shutter: {exposure_ms: 101}"),
              HasSubstr("key 'shutter': exposes for 101 ms, but an image begins every 100 ms"));
  EXPECT_EQ(complaint("exposure_ms: 1", "exposure_ms: 101"), "no complaint");  // it is triggered
  EXPECT_EQ(complaint("products: [truth, flow]", "products: [raw]"), "no complaint");
}

TEST(SceneFile, ReportsFaultsInStereoPairs) {
  const auto complaint = [](std::string_view from, std::string_view to) {
    return scene_complaint(with(camera_scene(), from, to));
  };
  EXPECT_THAT(complaint("right: right", "right: rihgt"),
              HasSubstr("key 'right': is 'rihgt', but the scene has the cameras left, right, road; "
                        "did you mean 'right'?"));
  EXPECT_THAT(complaint("right: right", "right: left"), HasSubstr("has the same camera twice"));
  EXPECT_THAT(complaint("right: right", "right: road"),
              HasSubstr("'left' and 'road' are not exposed at the same times"));
  EXPECT_THAT(complaint("images: rectified", "images: rectifed"),
              HasSubstr("must be one of as_mounted, rectified; did you mean 'rectified'?"));
}

TEST(SceneFile, RequiresAMaterialForCamerasAndASkyForRadiance) {
  EXPECT_THAT(
      scene_complaint(with(camera_scene(), "  material: dry_soil\n", "")),
      HasSubstr("key 'terrain': must have a material, and so must each layer, for the camera"));
  const std::string dark =
      with(camera_scene(), "sky: {sun: {azimuth_deg: 90, elevation_deg: 30}}\n", "");
  EXPECT_THAT(scene_complaint(dark),
              HasSubstr("key 'sky': missing, but the camera 'road' measures"));
  EXPECT_EQ(scene_complaint(with(dark, "products: [picture]", "products: [truth]")),
            "no complaint");
  EXPECT_THAT(scene_complaint(with(dark, "products: [picture]", "products: [coverage]")),
              HasSubstr("key 'sky': missing"));
}

TEST(PresetNames, AreOfTheRequestedKind) {
  const auto folder = data_folder() / "sensors";
  const auto lidars = preset_names(folder, SensorKind::Lidar);
  const auto cameras = preset_names(folder, SensorKind::Camera);
  EXPECT_THAT(lidars, ::testing::Contains("sick_lms511"));
  EXPECT_THAT(lidars, Not(::testing::Contains("tum_vi_cam1")));
  EXPECT_THAT(cameras, ::testing::Contains("tum_vi_cam1"));
  EXPECT_EQ(lidars.size() + cameras.size(), preset_names(folder).size());
}

TEST(SceneReader, ReadsTheClassesOfLabels) {
  const auto classes = parse(with(scene_text, "duration_s",
                                  "classes: {40: ground, 0: object, 65535: fence_post}\n"
                                  "duration_s"))
                           .classes;
  EXPECT_EQ(classes, (std::map<std::uint16_t, std::string>{
                         {0, "object"}, {40, "ground"}, {65535, "fence_post"}}));
  EXPECT_TRUE(parse(scene_text).classes.empty());
}

TEST(SceneReader, RejectsClassesThatDoNotExistAndKeysThatAreNoLabels) {
  const auto about = [](const std::string& classes) {
    return complaint("duration_s", "classes: " + classes + "\nduration_s");
  };
  EXPECT_THAT(
      about("{1: grownd}"),
      HasSubstr("prairie.yaml:3:14: key 'classes': 1 is 'grownd', but must be one of ground, "
                "grass, "));
  EXPECT_THAT(about("{1: grownd}"), HasSubstr("did you mean 'ground'?"));
  EXPECT_THAT(about("{tree: 1}"), HasSubstr("'tree' must be a label, a whole number from 0 to"));
  EXPECT_THAT(about("{65536: tree}"), HasSubstr("'65536' must be a label"));
  EXPECT_THAT(about("{-1: tree}"), HasSubstr("'-1' must be a label"));
  EXPECT_THAT(about("[tree]"), HasSubstr("is a list of 1, but must be a map"));
  EXPECT_THAT(about("{1: tree, 1: grass}"), HasSubstr("repeated; first given in line 3"));
}

}  // namespace
}  // namespace groundray::scene_reader_test
