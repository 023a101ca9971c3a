#include "apps/view/recorded/timeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <string>

#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/ply_io.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray::timeline_test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

// Writes a dataset of two lidars whose frames are not listed in order of time; two frames of
// different lidars have the same stamp.
void write_dataset(const TemporaryFolder& folder) {
  write(folder / "dataset.yaml",
        "groundray_dataset: 1\norigin_w_m: [400000, 5000000, 100]\ncrs: EPSG:32632\nsensors:\n"
        "  - {name: top, kind: lidar}\n  - {name: rear, kind: lidar}\nframes:\n"
        "  - {sensor: rear, frame: 0, stamp_s: 0.2, state: done}\n"
        "  - {sensor: top, frame: 1, stamp_s: 0.2, state: done}\n"
        "  - {sensor: top, frame: 0, stamp_s: 0.1, state: done}\n"
        "  - {sensor: top, frame: 3, stamp_s: 0.4, state: pending}\n"
        "  - {sensor: top, frame: 2, stamp_s: 0.3, state: done}\n");
  for (const std::string name : {"top", "rear"}) {
    write(folder / "poses" / (name + ".tum"), "0 1 2 3 0 0 0 1\n0.5 2 2 3 0 0 1 0\n");
    write(folder / ("calibration/" + name + ".yaml"), "range_noise_sigma_m: 0\n");
  }
}

TEST(Timeline, SortsFramesByStampThenSensor) {
  const TemporaryFolder folder;
  write_dataset(folder);
  const Timeline timeline(folder.path());
  ASSERT_EQ(timeline.sensors().size(), 2U);
  EXPECT_EQ(timeline.sensor_named("rear"), 1U);
  EXPECT_THROW(timeline.sensor_named("front"), Error);
  std::vector<std::string> events;
  for (const TimelineEvent& event : timeline.events()) {
    const RecordedSensor& sensor = timeline.sensors()[event.sensor];
    events.push_back(sensor.frames[event.frame].file.filename().string() + " of " + sensor.name);
  }
  EXPECT_THAT(events, ElementsAre("000000.ply of top", "000001.ply of top", "000000.ply of rear",
                                  "000002.ply of top"));
  EXPECT_EQ(timeline.begin(), 100ms);
  EXPECT_EQ(timeline.end(), 300ms);
  EXPECT_EQ(timeline.sensors()[0].pending, 1U);
  EXPECT_FALSE(timeline.sensors()[0].lidar);
  EXPECT_EQ(timeline.georeference().origin_w_m.y, 5e6);
}

TEST(Timeline, StepsFromFrameToFrame) {
  const TemporaryFolder folder;
  write_dataset(folder);
  const Timeline timeline(folder.path());
  EXPECT_EQ(timeline.current(0, 99ms), std::nullopt);
  EXPECT_EQ(timeline.current(0, 100ms), 0U);
  EXPECT_EQ(timeline.current(0, 10s), 2U);
  EXPECT_EQ(timeline.current(1, 199ms), std::nullopt);
  EXPECT_EQ(timeline.current(1, 250ms), 0U);
  EXPECT_EQ(timeline.next(0ms), 100ms);
  EXPECT_EQ(timeline.next(100ms), 200ms);
  EXPECT_EQ(timeline.next(0ms, 1), 200ms);
  EXPECT_EQ(timeline.next(300ms), std::nullopt);
  EXPECT_EQ(timeline.previous(300ms), 200ms);
  EXPECT_EQ(timeline.previous(300ms, 1), 200ms);
  EXPECT_EQ(timeline.previous(200ms, 1), std::nullopt);
  EXPECT_EQ(timeline.previous(100ms), std::nullopt);
}

// Between the two poses the body turns by half a turn as it moves. A constant twist traces a
// semicircle of diameter 1 m about the midpoint.
TEST(Timeline, FollowsAPathOfConstantTwist) {
  const TemporaryFolder folder;
  write_dataset(folder);
  const Timeline timeline(folder.path());
  const glm::dvec3 middle_m(1.5, 2, 3);
  for (const glm::dvec3& p : timeline.trail_m(0, 400ms, 10ms))
    EXPECT_NEAR(glm::distance(p, middle_m), 0.5, 1e-12);
  EXPECT_EQ(timeline.trail_m(0, 400ms, 10ms).size(), 41U);
  EXPECT_EQ(timeline.trail_m(0, 400ms, 30ms).size(), 15U);
  EXPECT_EQ(timeline.trail_m(0, -1s).size(), 1U);
  EXPECT_EQ(timeline.trail_m(0, 10s).back(), glm::dvec3(2, 2, 3));
  EXPECT_LT(timeline.trail_m(0, 10s, 1ns).size(), 100'003U);
  EXPECT_THROW(timeline.trail_m(0, 1s, 0ns), Error);
  EXPECT_NEAR(glm::distance(timeline.pose_at(0, 250ms).translation_m, middle_m), 0.5, 1e-12);
  EXPECT_EQ(timeline.pose_at(0, -5s).translation_m, glm::dvec3(1, 2, 3));
  EXPECT_EQ(timeline.pose_at(0, 5s).translation_m, glm::dvec3(2, 2, 3));
}

TEST(Timeline, IsEmptyWithoutFrames) {
  const TemporaryFolder folder;
  write(folder / "dataset.yaml",
        "groundray_dataset: 1\norigin_w_m: [0, 0, 0]\nsensors: []\nframes: []\n");
  const Timeline timeline(folder.path());
  EXPECT_TRUE(timeline.events().empty());
  EXPECT_EQ(timeline.begin(), 0ns);
  EXPECT_EQ(timeline.end(), 0ns);
  EXPECT_EQ(timeline.next(0ns), std::nullopt);
}

TEST(Timeline, ReportsTheFileAtFault) {
  const TemporaryFolder folder;
  write_dataset(folder);
  write(folder / "calibration/top.yaml",
        "X_BS: {translation_m: [0, 0, 0], rotation_xyzw: [0, 0, 0, 2]}\n");
  try {
    const Timeline timeline(folder.path());
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), AllOf(HasSubstr("top.yaml:1"), HasSubstr("must have length 1")));
  }
}

TEST(Timeline, ReadsAGeneratedDataset) {
  const Timeline timeline(SampleDataset::get().path());
  ASSERT_EQ(timeline.sensors().size(), 2U);
  const RecordedSensor& top = timeline.sensors()[0];
  const RecordedSensor& eye = timeline.sensors()[1];
  EXPECT_EQ(top.kind, SensorKind::Lidar);
  EXPECT_EQ(top.model, "Velodyne VLP-16 (Puck)");
  EXPECT_EQ(top.frames.size(), 5U);
  EXPECT_NEAR(std::chrono::duration<double>(top.lasts).count(), 0.1, 1e-4);
  EXPECT_EQ(top.X_BS.translation_m, glm::dvec3(0.2, 0, 1.6));
  ASSERT_TRUE(top.lidar);
  EXPECT_TRUE(top.lidar->is_whole);
  EXPECT_EQ(top.lidar->spec.beam.divergence_rad, glm::dvec2(3e-3, 1.5e-3));
  EXPECT_EQ(top.lidar->spec.range_noise_sigma_m, 0.02);
  ASSERT_TRUE(eye.camera);
  EXPECT_EQ(eye.camera->lens.size_px(), glm::ivec2(64, 48));
  EXPECT_EQ(eye.camera->middle_of_row(10), 6ms);
  EXPECT_EQ(eye.lasts, 25'500us);
  EXPECT_EQ(eye.frames.size(), 3U);  // at 20, 220 and 420 ms
  const auto& labels = timeline.names().labels;
  EXPECT_EQ(labels.at(3), "ground");
  EXPECT_EQ(labels.at(12), "post");
  EXPECT_EQ(timeline.end(), top.frames.back().stamp + top.lasts);
}

// Points of the cart, transformed back by its pose, lie within its model's bounding box at any
// time.
TEST(Timeline, PlacesMovingObjectsWhereScansHitThem) {
  const Simulation simulation = load_simulation(SampleDataset::get().scene());
  const std::vector<MovingThing> things = moving_things(simulation);
  ASSERT_EQ(things.size(), 1U);
  EXPECT_EQ(things[0].name, "cart");
  EXPECT_EQ(things[0].label, 10);
  EXPECT_EQ(things[0].instance, 2U);
  const RecordedRun run = read_recorded_run(SampleDataset::get().path());
  int seen = 0;
  for (const RecordedFrame& frame : run.sensors[0].frames) {
    const PointCloud scan = read_ply(frame.file).cloud;
    const auto instance = scan.column<std::uint32_t>("instance");
    const auto time = scan.column<float>("time");
    const auto x = scan.column<double>("world_x"), y = scan.column<double>("world_y"),
               z = scan.column<double>("world_z");
    for (std::size_t i = 0; i < scan.rows(); ++i) {
      if (instance[i] != things[0].instance) continue;
      const PlacedObject at = place_of(simulation, things[0], frame.stamp + time_of(time[i]));
      const glm::dvec3 p_O =
          glm::inverse(at.R_DO) * (glm::dvec3(x[i], y[i], z[i]) - at.p_DO) / at.scale;
      EXPECT_LT(std::abs(p_O.x), 3.0);
      EXPECT_LT(std::abs(p_O.y), 1.5);
      EXPECT_GT(p_O.z, -0.5);
      EXPECT_LT(p_O.z, 3.0);
      ++seen;
    }
  }
  EXPECT_GT(seen, 20);
}

}  // namespace
}  // namespace groundray::timeline_test
