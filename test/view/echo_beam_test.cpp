#include "apps/view/echo_beam.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <string>

#include "apps/groundray/generate.h"
#include "core/error.h"
#include "core/io/ply_io.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray::echo_beam_test {
namespace {

using groundray::testing::SampleDataset;
using groundray::testing::TemporaryFolder;

struct SampleScan {
  RecordedRun run;
  RecordedFrame frame;
  PointCloud scan;

  const RecordedSensor& lidar() const { return run.sensors[0]; }
};

SampleScan scan_of(const std::filesystem::path& dataset, std::size_t frame) {
  RecordedRun run = read_recorded_run(dataset);
  RecordedFrame which = run.sensors[0].frames.at(frame);
  PointCloud scan = read_ply(which.file).cloud;
  return {std::move(run), std::move(which), std::move(scan)};
}

glm::dvec3 true_point(const PointCloud& scan, std::size_t row) {
  return {scan.column<double>("world_x")[row], scan.column<double>("world_y")[row],
          scan.column<double>("world_z")[row]};
}

// Heights of the VLP-16's beam origins by ring, from the sensor's table.
constexpr std::array ring_height_m{0.0112,  0.0097,  0.0081,  0.0066,  0.0051,  0.0037,
                                   0.0022,  0.0007,  -0.0007, -0.0022, -0.0037, -0.0051,
                                   -0.0066, -0.0081, -0.0097, -0.0112};

// The true point lies on the beam, whatever the noise along it, and the beam's origin is that of
// the table.
TEST(Beam, StartsAtItsOwnOriginAndContainsTheTruePoint) {
  const SampleScan sample = scan_of(SampleDataset::get().path(), 2);
  for (std::size_t row = 0; row < sample.scan.rows(); row += 97) {
    const EchoBeam beam = echo_beam(sample.lidar(), sample.frame, sample.scan, row);
    ASSERT_TRUE(beam.is_origin_exact) << row;
    const glm::dvec3 to_m = true_point(sample.scan, row) - beam.origin_m;
    const double aside_m = glm::length(glm::cross(to_m, beam.direction));
    EXPECT_LT(aside_m, 2e-5) << row;  // single precision at 60 m
    groundray::testing::record_margin("truth aside of its beam", aside_m, 2e-5, "m");
    EXPECT_NEAR(glm::length(to_m), sample.scan.column<double>("range_true")[row], 1e-6);
    EXPECT_NEAR(beam.range_m, glm::length(to_m), 5 * 0.02);  // five sigma of noise
    const Pose X_DS = sample.lidar().X_DS.pose_at(sample.frame.stamp +
                                                  time_of(sample.scan.column<float>("time")[row]));
    const glm::dvec3 origin_S = inverse(X_DS) * beam.origin_m;
    EXPECT_NEAR(origin_S.z, ring_height_m[sample.scan.column<std::uint16_t>("ring")[row]], 1e-6);
    EXPECT_LT(std::hypot(origin_S.x, origin_S.y), 1e-6);
  }
}

// 1/e^2 radii from the scene's beam: w(R)^2 = w0^2 + (R tan(divergence / 2))^2.
TEST(Beam, HasTheFootprintOfItsDivergence) {
  const SampleScan sample = scan_of(SampleDataset::get().path(), 0);
  const std::size_t row = sample.scan.rows() / 2;
  const EchoBeam beam = echo_beam(sample.lidar(), sample.frame, sample.scan, row, 90);
  const double across_m = std::hypot(6e-3, beam.range_m * std::tan(1.5e-3));
  const double up_m = std::hypot(4e-3, beam.range_m * std::tan(0.75e-3));
  EXPECT_NEAR(beam.horizontal_radius_m, across_m, 1e-12);
  EXPECT_NEAR(beam.vertical_radius_m, up_m, 1e-12);
  EXPECT_NEAR(glm::dot(beam.horizontal, beam.direction), 0, 1e-12);
  EXPECT_NEAR(glm::length(beam.vertical), 1, 1e-12);
  ASSERT_EQ(beam.across_m.size(), 91U);
  EXPECT_EQ(beam.across_m.front(), beam.across_m.back());
  EXPECT_EQ(beam.waist_m.size(), 91U);
  for (const glm::dvec3& p : beam.across_m) {
    const glm::dvec3 off = p - beam.origin_m;
    EXPECT_NEAR(glm::dot(off, beam.direction), beam.range_m, 1e-9);
    const double h = glm::dot(off, beam.horizontal) / across_m;
    const double v = glm::dot(off, beam.vertical) / up_m;
    EXPECT_NEAR(h * h + v * v, 1, 1e-9);
  }
  ASSERT_EQ(beam.surface_m.size(), 91U);
  const glm::dvec3 normal(sample.scan.column<float>("nx")[row],
                          sample.scan.column<float>("ny")[row],
                          sample.scan.column<float>("nz")[row]);
  for (const glm::dvec3& p : beam.surface_m)
    EXPECT_NEAR(glm::dot(p - true_point(sample.scan, row), glm::normalize(normal)), 0, 1e-9);
}

// A sensor with a laser: its points are in S at the stamp, and its pulses are identified by number.
TEST(Beam, IsIdentifiedByPulseNumberInDeskewedScans) {
  const TemporaryFolder folder;
  std::string text = groundray::testing::sample_scene();
  text.erase(text.find("cameras:"));
  text.insert(text.find("    beam:"),
              "    points: at_stamp\n    angular_jitter_mrad: 0\n"
              "    laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}\n"
              "    receiver: {aperture_mm: 20, threshold_w: 1.0e-7, timing: peak, returns: all}\n");
  text.replace(text.find("duration_s: 0.5"), 15, "duration_s: 0.2");
  groundray::generate(groundray::testing::write_sample_scene(folder.path(), text), folder / "out",
                      {});
  const SampleScan sample = scan_of(folder / "out", 1);
  EXPECT_EQ(sample.lidar().points, LidarSpec::Points::AtStamp);
  ASSERT_TRUE(sample.scan.has("pulse"));
  std::size_t exact = 0, rows = 0;
  for (std::size_t row = 0; row < sample.scan.rows(); row += 101, ++rows) {
    const EchoBeam beam = echo_beam(sample.lidar(), sample.frame, sample.scan, row);
    exact += beam.is_origin_exact ? 1 : 0;
    const glm::dvec3 to_m = true_point(sample.scan, row) - beam.origin_m;
    EXPECT_LT(glm::length(glm::cross(to_m, beam.direction)), 1e-3) << row;  // one sub-ray
  }
  EXPECT_EQ(exact, rows);
}

TEST(Beam, StartsAtTheSensorIfTheOriginIsUnknown) {
  SampleScan sample = scan_of(SampleDataset::get().path(), 1);
  sample.run.sensors[0].lidar.reset();
  const EchoBeam beam = echo_beam(sample.lidar(), sample.frame, sample.scan, 10);
  EXPECT_FALSE(beam.is_origin_exact);
  EXPECT_EQ(beam.horizontal_radius_m, 0);
  const Pose X_DS = sample.lidar().X_DS.pose_at(sample.frame.stamp +
                                                time_of(sample.scan.column<float>("time")[10]));
  EXPECT_EQ(beam.origin_m, X_DS.translation_m);
  const auto x = sample.scan.column<float>("x"), y = sample.scan.column<float>("y"),
             z = sample.scan.column<float>("z");
  EXPECT_LT(glm::distance(beam.reported_m, X_DS * glm::dvec3(x[10], y[10], z[10])), 1e-12);
}

TEST(Beam, RejectsEchoesWithoutABeam) {
  const SampleScan sample = scan_of(SampleDataset::get().path(), 0);
  EXPECT_THROW(echo_beam(sample.lidar(), sample.frame, sample.scan, sample.scan.rows()), Error);
  EXPECT_THROW(echo_beam(sample.run.sensors[1], sample.frame, sample.scan, 0), Error);
  EXPECT_THROW(echo_beam(sample.lidar(), sample.frame, PointCloud(3), 0), Error);
  PointCloud here(1);
  for (const char* name : {"x", "y", "z"})
    here.add<float>(name)[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(echo_beam(sample.lidar(), sample.frame, here, 0), Error);
}

TEST(Beam, ListsAllColumnsOfAnEcho) {
  PointCloud scan(2);
  scan.add<float>("x")[1] = 1.5F;
  scan.add<double>("range_true")[1] = std::numeric_limits<double>::quiet_NaN();
  scan.add<std::uint16_t>("label")[1] = 12;
  scan.add<std::uint32_t>("instance")[1] = 7;
  scan.add<std::uint8_t>("kind")[1] = 1;
  scan.add<std::int32_t>("other")[1] = -4;
  RecordedNames names;
  names.labels[12] = "post";
  names.objects.push_back({.name = "posts", .label = 12, .first = 5, .count = 3});
  std::string text;
  for (const EchoValue& value : echo_values(scan, 1, names))
    text += value.column + " " + value.text + "; ";
  EXPECT_EQ(text,
            "x 1.5 m; range_true none; label 12 (post); instance 7 (posts); kind 1 (air); "
            "other -4; ");
  EXPECT_THROW(echo_values(scan, 2), Error);
  const SampleScan sample = scan_of(SampleDataset::get().path(), 0);
  EXPECT_EQ(echo_values(sample.scan, 0).size(), sample.scan.columns().size());
}

}  // namespace
}  // namespace groundray::echo_beam_test
