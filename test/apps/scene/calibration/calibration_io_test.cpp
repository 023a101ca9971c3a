#include "apps/scene/calibration/calibration_io.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "test/support/temporary_folder.h"

namespace groundray::calibration_io_test {
namespace {

using groundray::testing::data_folder;
using groundray::testing::shared_data_folder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

constexpr double degree = std::numbers::pi / 180;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

constexpr const char* matrix = "[-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36, 0, 0, 0, 1]";
const std::string flat_ouster = std::string(R"({
  "beam_altitude_angles": [10, 0.5, -10], "beam_azimuth_angles": [3, 0, -3],
  "data_format": {"column_window": [0, 1023]},
  "lidar_mode": "1024x10", "lidar_origin_to_beam_origin_mm": 15,
  "lidar_to_sensor_transform": )") +
                                matrix + "}";
const std::string nested_ouster = std::string(R"({
  "beam_intrinsics": {"beam_altitude_angles": [10, 0.5, -10], "beam_azimuth_angles": [3, 0, -3],
    "beam_to_lidar_transform": [1, 0, 0, 15, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
  "lidar_data_format": {"column_window": [0, 1023]},
  "config_params": {"lidar_mode": "1024x10"},
  "lidar_intrinsics": {"lidar_to_sensor_transform": )") +
                                  matrix + "}}";

void expect_same_beam(const Beam& a, const Beam& b) {
  EXPECT_EQ(a.elevation_rad, b.elevation_rad);
  EXPECT_EQ(a.azimuth_offset_rad, b.azimuth_offset_rad);
  EXPECT_EQ(a.origin_m, b.origin_m);
  EXPECT_EQ(a.ring, b.ring);
}

TEST(OusterMetadata, BothLayoutsYieldTheSameLidar) {
  const SpinningPattern flat = parse_ouster_metadata(flat_ouster, "m.json");
  const SpinningPattern nested = parse_ouster_metadata(nested_ouster, "m.json");
  ASSERT_THAT(flat.beams, SizeIs(3));
  ASSERT_THAT(nested.beams, SizeIs(3));
  for (std::size_t i = 0; i < 3; ++i) expect_same_beam(flat.beams[i], nested.beams[i]);
  EXPECT_EQ(flat.firing_period_s, nested.firing_period_s);
  EXPECT_EQ(flat.start_azimuth_rad, nested.start_azimuth_rad);
  EXPECT_DOUBLE_EQ(flat.beams[0].elevation_rad, 10 * degree);
  EXPECT_DOUBLE_EQ(flat.beams[0].azimuth_offset_rad, -3 * degree);
  EXPECT_DOUBLE_EQ(flat.beams[0].origin_m.x, 0.015);
  EXPECT_DOUBLE_EQ(flat.beams[0].origin_m.z, 0.036);
  EXPECT_DOUBLE_EQ(flat.firing_period_s, 97.65625e-6);
  EXPECT_DOUBLE_EQ(std::abs(flat.start_azimuth_rad), std::numbers::pi);
  EXPECT_FALSE(flat.field_of_view);
}

// Column c fires at encoder angle 2 pi - 2 pi c / 1024, measured from -x.
TEST(OusterMetadata, FiresOnlyTheColumnsOfTheWindow) {
  for (const auto& [first, last] : {std::pair(0, 511), {100, 100 + 1}, {1000, 23}, {5, 1023}}) {
    std::string text = flat_ouster;
    text.replace(text.find("[0, 1023]"), 9,
                 "[" + std::to_string(first) + ", " + std::to_string(last) + "]");
    const ScanPattern scan(parse_ouster_metadata(text, "m.json"));
    const int columns = last - first + 1 + (last < first ? 1024 : 0);
    for (const std::int64_t sweep : {0, 1, 1000}) {
      ASSERT_EQ(scan.pulses(sweep), 3 * columns);
      PulseBatch batch;
      scan.fill(sweep, 0, scan.pulses(sweep), batch);
      for (int i = 0; i < columns; ++i) {
        // A window that wraps fires its last part at the start of the turn.
        const int column = last < first ? (i <= last ? i : first + i - last - 1) : first + i;
        const double azimuth = std::numbers::pi - 2 * std::numbers::pi * column / 1024;
        const glm::dvec3& d = batch.direction[3 * static_cast<std::size_t>(i) + 1];  // azimuth 0
        ASSERT_NEAR(std::remainder(std::atan2(d.y, d.x) - azimuth, 2 * std::numbers::pi), 0, 1e-10);
      }
    }
  }
}

TEST(OusterMetadata, ListsEveryFault) {
  EXPECT_THAT([] { parse_ouster_metadata("{\"lidar_mode\": \"fast\"}", "m.json"); },
              ThrowsMessage<Error>(AllOf(
                  HasSubstr("m.json"), HasSubstr("key 'beam_altitude_angles' is missing: is this"),
                  HasSubstr("key 'beam_azimuth_angles' is missing"),
                  HasSubstr("key 'lidar_mode' must be a text such as \"1024x10\""),
                  HasSubstr("key 'lidar_origin_to_beam_origin_mm' must be a number"),
                  HasSubstr("key 'lidar_to_sensor_transform' is missing"))));
  EXPECT_THAT([] { parse_ouster_metadata("{", "m.json"); },
              ThrowsMessage<Error>(HasSubstr("m.json: its JSON is invalid at byte 2")));
  std::string text = flat_ouster;
  text.replace(text.find("[3, 0, -3]"), 10, "[3, 0]");
  EXPECT_THAT([&] { parse_ouster_metadata(text, "m.json"); },
              ThrowsMessage<Error>(
                  HasSubstr("key 'beam_azimuth_angles' must be a list of 3 finite numbers")));
}

constexpr const char* two_lasers_yaml = R"(
distance_resolution: 0.002
lasers:
- {laser_id: 1, rot_correction: 0.25, vert_correction: -0.125, vert_offset_correction: 0.2,
   horiz_offset_correction: 0.026, dist_correction: 1.4}
- laser_id: 0
  rot_correction: -0.5
  vert_correction: 0.0625
num_lasers: 2
)";

// Point given by the ROS driver's formula (docs/reference/sensors.md), 20 m from the beam's origin,
// at encoder angle 0: x forward is y in the driver's own frame.
glm::dvec3 driver_point(double a, double v, double o, double h) {
  const double xy = 20 * std::cos(v) - o * std::sin(v);
  return {xy * std::cos(a) - h * std::sin(a), xy * std::sin(a) + h * std::cos(a),
          20 * std::sin(v) + o * std::cos(v)};
}

void expect_two_lasers(const std::vector<Beam>& beams, double tolerance) {
  ASSERT_THAT(beams, SizeIs(2));
  EXPECT_EQ(beams[0].ring, 1);
  EXPECT_EQ(beams[1].ring, 0);
  const glm::dvec3 expected[] = {driver_point(-0.5, 0.0625, 0, 0),
                                 driver_point(0.25, -0.125, 0.2, 0.026)};
  for (std::size_t i = 0; i < 2; ++i) {
    const double level = std::cos(beams[i].elevation_rad);
    const glm::dvec3 direction(level * std::cos(beams[i].azimuth_offset_rad),
                               level * std::sin(beams[i].azimuth_offset_rad),
                               std::sin(beams[i].elevation_rad));
    EXPECT_LE(glm::distance(beams[i].origin_m + 20. * direction, expected[i]), tolerance);
  }
}

TEST(VelodyneYaml, BeamsMatchTheDriversPoints) {
  expect_two_lasers(parse_velodyne_yaml(two_lasers_yaml, "c.yaml"), 20 * 4 * epsilon);
}

TEST(VelodyneYaml, ListsEveryFaultWithItsLine) {
  EXPECT_THAT(
      [] {
        parse_velodyne_yaml("lasers:\n- laser_id: 0\n  vert_correction: 15\n- laser_id: x\n",
                            "c.yaml");
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("c.yaml:2:3: key 'rot_correction': missing"),
                                 HasSubstr("c.yaml:3:20: key 'vert_correction': is 15"),
                                 HasSubstr("is it in degrees?"),
                                 HasSubstr("c.yaml:4:13: key 'laser_id'"))));
  EXPECT_THAT([] { parse_velodyne_yaml("beams: []\n", "c.yaml"); },
              ThrowsMessage<Error>(HasSubstr("is this the calibration of a Velodyne?")));
}

std::string px(const char* id, double rotation_rad, double elevation_rad, double up_cm,
               double left_cm) {
  return fmt::format(
      "<item><px><id_>{}</id_><rotCorrection_>{:.17g}</rotCorrection_>"
      "<vertCorrection_>{:.17g}</vertCorrection_><vertOffsetCorrection_>{}</vertOffsetCorrection_>"
      "<horizOffsetCorrection_>{}</horizOffsetCorrection_></px></item>\n",
      id, rotation_rad / degree, elevation_rad / degree, up_cm, left_cm);
}

std::string db_xml(const std::string& points) {
  return "<?xml version=\"1.0\"?>\n<boost_serialization><DB><enabled_><count>3</count>"
         "<item>1</item><item>1</item><item>0</item></enabled_>\n<points_><count>3</count>\n" +
         points + "</points_></DB></boost_serialization>";
}

TEST(VelodyneXml, MatchesTheYamlInDegreesAndCentimetresWithoutDisabledLasers) {
  const std::string text =
      db_xml(px("0", -0.5, 0.0625, 0, 0) + px("2", 0, 0, 0, 0) + px("1", 0.25, -0.125, 20, 2.6));
  expect_two_lasers(parse_velodyne_xml(text, "db.xml"), 20 * 8 * epsilon);
}

TEST(VelodyneXml, ListsEveryFaultWithItsLine) {
  const std::string text = db_xml(px("0", 0, 0, 0, 0) + px("0", 0, 2, 0, 0) +
                                  "<item><px><id_>x</id_></px></item>\n<item/>\n");
  EXPECT_THAT([&] { parse_velodyne_xml(text, "db.xml"); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("line 5: id_ 0 is repeated"),
                        HasSubstr("line 5: vertCorrection_ must be from -90 to 90 degrees"),
                        HasSubstr("line 6: id_ must be a finite number"),
                        HasSubstr("line 6: rotCorrection_ is missing"),
                        HasSubstr("line 7: an item of points_ has no <px>"))));
  EXPECT_THAT([] { parse_velodyne_xml("<a>", "db.xml"); },
              ThrowsMessage<Error>(HasSubstr("db.xml:1: not XML")));
  EXPECT_THAT([] { parse_velodyne_xml("<a/>", "db.xml"); },
              ThrowsMessage<Error>(HasSubstr("is this the db.xml of a Velodyne?")));
}

TEST(HesaiCsv, ReadsChannelsInAnyOrder) {
  const auto beams =
      parse_hesai_csv("eeff,1,1\nLaser id,Elevation,Azimuth\r\n2,-1.5,3\r\n1,14.7,-1.042\r\n", "a");
  ASSERT_THAT(beams, SizeIs(2));
  EXPECT_EQ(beams[0].ring, 0);
  EXPECT_DOUBLE_EQ(beams[0].elevation_rad, 14.7 * degree);
  EXPECT_DOUBLE_EQ(beams[0].azimuth_offset_rad, 1.042 * degree);  // clockwise is negative
  EXPECT_DOUBLE_EQ(beams[1].azimuth_offset_rad, -3 * degree);
}

TEST(HesaiCsv, ListsEveryFaultWithItsLine) {
  EXPECT_THAT(
      [] {
        parse_hesai_csv("Channel,Elevation,Azimuth\n1,0\n0,0,0\n2,95,0\n3,a,0\n4,0,0\n4,0,0\n",
                        "a.csv");
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("a.csv:2: it has no Azimuth"),
                                 HasSubstr("a.csv:3: Channel = 0 must be"),
                                 HasSubstr("a.csv:4: Elevation = 95 must be from -90 to 90"),
                                 HasSubstr("a.csv:5: Elevation = 'a' must be a finite number"),
                                 HasSubstr("a.csv:7: Channel 4 is repeated"))));
  EXPECT_THAT([] { parse_hesai_csv("1,2,3\n", "a.csv"); },
              ThrowsMessage<Error>(HasSubstr("no line has the column names")));
}

TEST(Calibration, AppliesToAPreset) {
  SpinningPattern pattern{.firing_period_s = 1e-4};
  pattern.beams = {{.firing_time_s = 1e-6}, {.firing_time_s = 2e-6}};
  const auto unit = parse_velodyne_yaml(two_lasers_yaml, "c.yaml");
  const SpinningPattern calibrated = with_calibration(pattern, unit);
  for (std::size_t i = 0; i < 2; ++i) {
    expect_same_beam(calibrated.beams[i], unit[i]);
    EXPECT_EQ(calibrated.beams[i].firing_time_s, pattern.beams[i].firing_time_s);
  }
  EXPECT_THAT([&] { with_calibration(pattern, std::span(unit).first(1)); },
              ThrowsMessage<Error>(HasSubstr("it has 1 beams, but the pattern has 2")));
}

TEST(Calibration, MatchesTheBeamsOfLoopsByTheirRings) {
  SpinningPattern pattern{.firing_period_s = 1e-4};
  pattern.beams = {{.firing_time_s = 1e-6, .ring = 1, .loop = 0},
                   {.firing_time_s = 2e-6, .ring = 0, .loop = 1},
                   {.firing_time_s = 3e-6, .ring = 1, .loop = 1}};
  const auto unit = parse_hesai_csv("Channel,Elevation,Azimuth\n1,5,1\n2,-5,-2\n", "a.csv");
  const SpinningPattern calibrated = with_calibration(pattern, unit);
  for (std::size_t i = 0; i < 3; ++i) {
    const Beam& beam = calibrated.beams[i];
    EXPECT_EQ(beam.ring, pattern.beams[i].ring);
    EXPECT_EQ(beam.loop, pattern.beams[i].loop);
    EXPECT_EQ(beam.firing_time_s, pattern.beams[i].firing_time_s);
    EXPECT_DOUBLE_EQ(beam.elevation_rad, (beam.ring == 0 ? 5 : -5) * degree);
  }
  EXPECT_THAT([&] { with_calibration(pattern, std::span(unit).first(1)); },
              ThrowsMessage<Error>(HasSubstr("it has 1 beams, but the pattern has 2")));
}

TEST(Calibration, FormatIsChosenByTheExtension) {
  const testing::TemporaryFolder folder;
  SpinningPattern pattern{.firing_period_s = 1e-4};
  pattern.beams = {Beam{}, Beam{}};
  std::ofstream(folder / "unit.YML") << two_lasers_yaml;
  const PatternSpec unit = calibrated(pattern, folder / "unit.YML");
  EXPECT_EQ(std::get<SpinningPattern>(unit).beams[1].elevation_rad,
            parse_velodyne_yaml(two_lasers_yaml, "")[1].elevation_rad);
  EXPECT_THAT(
      [&] { calibrated(pattern, "unit.txt"); },
      ThrowsMessage<Error>(HasSubstr("unit.txt: must be .xml, .yaml or .yml of a Velodyne")));
  EXPECT_THAT(
      [&] { calibrated(LinePattern{}, "unit.csv"); },
      ThrowsMessage<Error>(HasSubstr("only spinning heads have calibrations of single units")));
}

// The presets were made from these files by other means and rounded: angles to 1e-4 degree, which
// moves an origin 0.22 m off the axis by 0.3 um, and each coordinate of an origin to the
// micrometre.
TEST(Calibration, PublishedFilesYieldThePresetsMadeFromThem) {
  const auto folder = shared_data_folder() / "lidar" / "velodyne_calibration";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no published calibrations at hand";
  const std::pair<const char*, const char*> files[] = {
      {"velodyne_vlp32c", "VLP-32C.yml"},
      {"velodyne_hdl32e", "HDL-32E.yml"},
      {"velodyne_hdl64e_s2", "HDL-64E_S2.1-sztaki.yml"},
      {"velodyne_vls128", "Alpha Prime.yml"},
      {"velodyne_hdl64e_s3", "HDL-64E_S3-xiesc.yml"}};
  for (const auto& [preset, file] : files) {
    const auto beams = load_velodyne_yaml(folder / file);
    const auto pattern =
        load_lidar(data_folder() / "sensors" / (std::string(preset) + ".yaml")).pattern;
    const auto& expected = std::get<SpinningPattern>(pattern).beams;
    ASSERT_EQ(beams.size(), expected.size()) << file;
    for (std::size_t i = 0; i < beams.size(); ++i) {
      EXPECT_NEAR(beams[i].elevation_rad, expected[i].elevation_rad, 0.5e-4 * degree + 1e-7);
      EXPECT_NEAR(beams[i].azimuth_offset_rad, expected[i].azimuth_offset_rad,
                  0.5e-4 * degree + 1e-7);
      EXPECT_LE(glm::distance(beams[i].origin_m, expected[i].origin_m), 1.2e-6) << file << i;
      EXPECT_EQ(beams[i].ring, expected[i].ring) << file << i;
    }
  }
}

TEST(Calibration, EveryPublishedFileIsRead) {
  const auto folder = shared_data_folder() / "lidar";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no published calibrations at hand";
  for (const auto& entry : std::filesystem::directory_iterator(folder / "velodyne_calibration")) {
    if (entry.path().extension() != ".yml") continue;
    EXPECT_NO_THROW(load_velodyne_yaml(entry.path())) << entry.path();
  }
  EXPECT_THAT(load_velodyne_yaml(folder / "nebula_velodyne_hesai" / "VLS128.yaml"), SizeIs(128));
  for (const auto& entry : std::filesystem::directory_iterator(folder / "ouster")) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(".json") || name.find("digest") != std::string::npos) continue;
    EXPECT_NO_THROW(ScanPattern{load_ouster_metadata(entry.path())}) << name;
  }
}

}  // namespace
}  // namespace groundray::calibration_io_test
