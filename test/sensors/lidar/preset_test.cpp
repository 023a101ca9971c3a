#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <ostream>
#include <set>
#include <sstream>

#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/yaml_reader.h"
#include "test/support/temporary_folder.h"

namespace groundray::preset_test {
namespace {

using groundray::testing::data_folder;
using groundray::testing::shared_data_folder;

SpinningPattern preset(const std::string& name) {
  return std::get<SpinningPattern>(
      load_lidar(data_folder() / "sensors" / (name + ".yaml")).pattern);
}

// Point that the vendor's own formula gives for one laser at encoder angle 35.15625 degrees (column
// 100 of 1024), with the target 20 m from the beam's origin. The formulas were evaluated
// independently of groundray:
// Velodyne: ros-drivers/velodyne, rawdata.cc, without its distance corrections:
//   xy = d cos v - o_v sin v,  a = encoder - rot_correction,  x_ros = xy cos a + o_h sin a,
//   y_ros = -xy sin a + o_h cos a,  z = d sin v + o_v cos v;
//   VLP-16 manual: z = d sin v + vertical correction.
// Ouster: ouster-sdk, xyzlut.cpp, with r = d + n and lidar_to_sensor_transform.
// Hesai: x_h = d cos e sin(encoder + offset), y_h = d cos e cos(encoder + offset);
//   x_S = y_h, y_S = -x_h.
// SICK: azimuth min_ang + k resolution.
struct Golden {
  const char* name;
  std::size_t beams;
  std::uint16_t ring;
  double firing_time_us;
  glm::dvec3 p_SQ;
  friend std::ostream& operator<<(std::ostream& out, const Golden& golden) {
    return out << golden.name;
  }
};
const Golden golden_points[] = {
    {"velodyne_vlp16", 16, 15, 34.56, {15.7945257, -11.1237601, 5.1651809}},       // laser 15
    {"velodyne_vlp32c", 32, 17, 0, {17.1485943, -10.2861013, -0.3490481}},         // laser 1
    {"velodyne_hdl32e", 32, 16, 1.152, {16.1353791, -11.3638161, -3.2424103}},     // laser 1
    {"velodyne_hdl64e_s2", 64, 41, 13.26, {17.8781682, -8.7451953, -1.9831324}},   // laser 9
    {"velodyne_hdl64e_s2", 64, 10, 20.46, {13.6136111, -13.0845970, -6.5936446}},  // laser 46
    {"velodyne_hdl64e_s3", 64, 41, 15.7, {17.4728244, -9.5844519, -1.6985099}},    // laser 9
    {"velodyne_hdl64e_s3", 64, 10, 24.1, {13.7113385, -13.0566611, -6.4457552}},   // laser 46
    {"velodyne_vls128", 128, 0, 10.66, {14.9837402, -10.2002476, -8.4523652}},     // laser 36
    {"ouster_os0_128", 128, 0, 0, {-9.9642854, 10.3132236, 14.0065007}},           // row 0
    {"ouster_os1_128", 128, 3, 0, {-16.1669472, 9.7217321, 6.7274923}},            // row 3
    {"ouster_os2_128", 128, 127, 0, {-16.4497185, 10.7306707, -3.7687179}},        // row 127
    {"hesai_pandar64", 64, 8, 47.136, {15.2346338, -12.9493075, 0.4704974}},       // channel 9
    {"hesai_xt32", 32, 31, 47.24, {15.7182593, -11.0700472, -5.5127471}},          // channel 32
    {"hesai_qt128", 192, 0, 2.312, {8.5446144, -8.6238883, -15.8939648}},          // channel 1
    {"sick_lms511", 1, 0, 0, {10.0471971, -17.2931729, 0}},                        // -59.84375 deg
};

class GoldenPoint : public ::testing::TestWithParam<Golden> {};

TEST_P(GoldenPoint, MatchesTheVendorsFormula) {
  constexpr double tolerance = 1e-6;  // beam origins in the files are rounded to the micrometre
  const Golden& golden = GetParam();
  const SpinningPattern spinning = preset(golden.name);
  const SpinningScan scan(spinning);
  const auto shots = scan.cycle().shots();
  EXPECT_EQ(shots.size(), golden.beams);

  const auto shot = std::ranges::find(shots, golden.ring, &FiringCycle::Shot::ring);
  ASSERT_NE(shot, shots.end());
  const auto beam = std::ranges::find(spinning.beams, golden.ring, &Beam::ring);
  EXPECT_NEAR(beam->firing_time_s * 1e6, golden.firing_time_us, 1e-9);

  const double spin = scan.cycle().head().angle_rad(35.15625 / 360 / spinning.rate_hz);
  const glm::dvec3 p_HQ = shot->origin_m + 20. * shot->direction;
  EXPECT_NEAR(p_HQ.x * std::cos(spin) - p_HQ.y * std::sin(spin), golden.p_SQ.x, tolerance);
  EXPECT_NEAR(p_HQ.x * std::sin(spin) + p_HQ.y * std::cos(spin), golden.p_SQ.y, tolerance);
  EXPECT_NEAR(p_HQ.z, golden.p_SQ.z, tolerance);
}

INSTANTIATE_TEST_SUITE_P(Presets, GoldenPoint, ::testing::ValuesIn(golden_points),
                         [](const auto& golden) {
                           return std::string(golden.param.name) + "_ring" +
                                  std::to_string(golden.param.ring);
                         });

TEST(Preset, EveryFileHasAGoldenPoint) {
  std::set<std::string> tested;
  for (const Golden& golden : golden_points) tested.insert(golden.name);
  EXPECT_THAT(preset_names(data_folder() / "sensors", SensorKind::Lidar),
              ::testing::ElementsAreArray(tested));
}

TEST(Preset, RingsAreNumberedFromZeroWithoutGaps) {
  for (const std::string& name : preset_names(data_folder() / "sensors", SensorKind::Lidar)) {
    const auto beams = preset(name).beams;
    std::set<std::uint16_t> rings;
    for (const Beam& beam : beams) rings.insert(beam.ring);
    EXPECT_EQ(*rings.rbegin(), rings.size() - 1) << name;
    const bool loops = std::ranges::any_of(beams, [](const Beam& beam) { return beam.loop > 0; });
    EXPECT_TRUE(loops || rings.size() == beams.size()) << name;
  }
}

// Except for the QT128, whose channels from 97 on lie between others.
TEST(Preset, VelodyneRingsRiseAndOthersFallWithElevation) {
  for (const std::string& name : preset_names(data_folder() / "sensors", SensorKind::Lidar)) {
    auto beams = preset(name).beams;
    std::ranges::sort(beams, {}, &Beam::ring);
    if (name == "hesai_qt128") continue;
    const bool rises = name.starts_with("velodyne");
    EXPECT_EQ(std::ranges::adjacent_find(beams,
                                         [&](const Beam& a, const Beam& b) {
                                           return (a.elevation_rad < b.elevation_rad) != rises;
                                         }),
              beams.end())
        << name;
  }
}

// Tables published by vendors and drivers, where they are available: yaml or json, which is also
// yaml.
yaml::Node published(const std::string& name) {
  const auto path = shared_data_folder() / "lidar" / name;
  std::ifstream file(path);
  if (!file) return {};
  return yaml::parse(std::string(std::istreambuf_iterator<char>(file), {}), path);
}

const yaml::Node& at(const yaml::Node& map, std::string_view key) {
  for (std::size_t i = 0; i < map.items.size(); i += 2) {
    if (map.items[i].text == key) return map.items[i + 1];
  }
  throw std::out_of_range(std::string(key));
}

TEST(Preset, VelodyneAnglesMatchThePublishedCalibrations) {
  const std::pair<const char*, const char*> tables[] = {
      {"velodyne_vlp16", "VLP-16.yml"},
      {"velodyne_vlp32c", "VLP-32C.yml"},
      {"velodyne_hdl32e", "HDL-32E.yml"},
      {"velodyne_hdl64e_s2", "HDL-64E_S2.1-sztaki.yml"},
      {"velodyne_hdl64e_s3", "HDL-64E_S3-xiesc.yml"},
      {"velodyne_vls128", "Alpha Prime.yml"}};
  for (const auto& [name, file] : tables) {
    const yaml::Node calibration = published(std::string("velodyne_calibration/") + file);
    if (calibration.kind == yaml::Node::Kind::Null) GTEST_SKIP() << "no published tables at hand";
    const auto beams = preset(name).beams;
    const auto& lasers = at(calibration, "lasers").items;
    ASSERT_EQ(lasers.size(), beams.size()) << name;
    const double tolerance = glm::radians(0.5e-4) + 1e-7;  // rounding of the preset and the table
    for (const yaml::Node& laser : lasers) {
      const Beam& beam = beams[std::stoul(at(laser, "laser_id").text)];
      EXPECT_NEAR(beam.elevation_rad, std::stod(at(laser, "vert_correction").text), tolerance)
          << name;
      EXPECT_NEAR(beam.azimuth_offset_rad, std::stod(at(laser, "rot_correction").text), tolerance)
          << name;
    }
  }
}

TEST(Preset, OusterOS2MatchesThePublishedUnit) {
  const yaml::Node unit = published("ouster/OS-2-128-U1_v2.3.0_1024x10.json");
  if (unit.kind == yaml::Node::Kind::Null) GTEST_SKIP() << "no published tables at hand";
  const auto beams = preset("ouster_os2_128").beams;
  for (std::size_t row = 0; row < 128; ++row) {
    EXPECT_DOUBLE_EQ(beams[row].elevation_rad,
                     glm::radians(std::stod(at(unit, "beam_altitude_angles").items[row].text)));
    EXPECT_DOUBLE_EQ(beams[row].azimuth_offset_rad,
                     -glm::radians(std::stod(at(unit, "beam_azimuth_angles").items[row].text)));
    EXPECT_DOUBLE_EQ(beams[row].origin_m.x,
                     1e-3 * std::stod(at(unit, "lidar_origin_to_beam_origin_mm").text));
    EXPECT_DOUBLE_EQ(beams[row].origin_m.z,
                     1e-3 * std::stod(at(unit, "lidar_to_sensor_transform").items[11].text));
  }
}

}  // namespace
}  // namespace groundray::preset_test
