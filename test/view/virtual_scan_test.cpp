#include "apps/view/virtual_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <stop_token>
#include <string>

#include "apps/groundray/generate.h"
#include "apps/scene/interruption.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/ply_io.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray::virtual_scan_test {
namespace {

using ::testing::HasSubstr;

// A lidar with a laser, made up for these tests.
constexpr const char* lamp =
    "groundray_lidar: 1\n"
    "model: Lamp\n"
    "rotation: {rate_hz: 10, sense: clockwise, start_azimuth_deg: 0}\n"
    "firing_period_us: 200\n"
    "range_gate_m: {near: 0.5, far: 60}\n"
    "beam_columns: [ring, elevation_deg, firing_time_us]\n"
    "beams: [[0, -12, 0], [1, -6, 20], [2, -2, 40], [3, 2, 60]]\n"
    "beam: {divergence_mrad: [3, 1.5], sub_rays: 16, most_sub_rays: 32}\n"
    "laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}\n"
    "receiver: {aperture_mm: 20, threshold_w: 1.0e-7, timing: peak, returns: all}\n"
    "sources: {all: made up}\n";

// The sample scene with its body at rest, heading north, and with the given lidar.
std::string scene_at_rest(const std::string& lidar) {
  std::string text = groundray::testing::sample_scene();
  text = text.substr(0, text.find("lidars:"));
  return text + "lidars:\n  - {name: top, mount: {}, " + lidar +
         "}\nsky:\n  sun: {elevation_deg: 40, azimuth_deg: 150}\n";
}

constexpr double rest_height_m = 1.75;

// Position of that body, in D.
SensorPlace rest() {
  return {.at_m = {-7, 4},
          .height_m = rest_height_m,
          .heading_rad = std::numbers::pi / 2,
          .stance = Stance::Upright};
}

// Writes such a scene, with the body placed on the ground of another scene.
std::filesystem::path write_scene_at_rest(const std::filesystem::path& folder,
                                          const Simulation& ground, const std::string& lidar) {
  const auto scene = groundray::testing::write_sample_scene(folder, scene_at_rest(lidar));
  std::ofstream(folder / "lamp.yaml") << lamp;
  const Pose X_DS = pose_at(rest(), ground.terrain.ground());
  const glm::dvec3 p_m = X_DS.translation_m + ground.terrain.header().origin_w_m;
  std::ofstream tum(folder / "body.tum");
  for (const int time_s : {0, 2}) {
    tum << fmt::format("{} {} {} {} {} {} {} {}\n", time_s, p_m.x, p_m.y, p_m.z, X_DS.rotation.x,
                       X_DS.rotation.y, X_DS.rotation.z, X_DS.rotation.w);
  }
  return scene;
}

const Simulation& sample_world() {
  static const Simulation simulation =
      load_simulation(groundray::testing::SampleDataset::get().scene());
  return simulation;
}

// Returns the name of the first column that differs; empty if none does.
std::string difference(const PointCloud& a, const PointCloud& b) {
  if (a.rows() != b.rows()) return fmt::format("{} rows and {}", a.rows(), b.rows());
  if (a.columns().size() != b.columns().size()) return "columns";
  for (std::size_t i = 0; i < a.columns().size(); ++i) {
    if (a.columns()[i].name != b.columns()[i].name) return a.columns()[i].name + " is not there";
    const bool is_same = std::visit(
        [&](const auto& values) {
          const auto& others = std::get<std::decay_t<decltype(values)>>(b.columns()[i].values);
          return std::memcmp(values.data(), others.data(), values.size() * sizeof values[0]) == 0;
        },
        a.columns()[i].values);
    if (!is_same) return a.columns()[i].name;
  }
  return "";
}

TEST(VirtualScan, OffersTheLidarPresets) {
  const std::vector<SensorPreset> presets = lidar_presets();
  const auto vlp16 = std::ranges::find(presets, "velodyne_vlp16", &SensorPreset::name);
  ASSERT_NE(vlp16, presets.end());
  EXPECT_EQ(vlp16->model, "Velodyne VLP-16 (Puck)");
  EXPECT_EQ(std::ranges::find(presets, "fisheye_190", &SensorPreset::name), presets.end());
  EXPECT_GE(presets.size(), 12U);
}

TEST(VirtualScan, PutsSensorsOnTheGround) {
  const Ground& ground = sample_world().terrain.ground();
  const Pose upright = pose_at(rest(), ground);
  EXPECT_DOUBLE_EQ(upright.translation_m.z - *ground.height_m_at({-7, 4}), rest_height_m);
  EXPECT_LT(glm::distance(upright.rotation * glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)), 1e-15);
  SensorPlace leaning = rest();
  leaning.stance = Stance::OnSlope;
  const Pose leant = pose_at(leaning, ground);
  EXPECT_EQ(leant.translation_m, upright.translation_m);
  const glm::dvec3 normal = ground.frame().normal(*ground.facet_at({-7, 4}));
  EXPECT_LT(glm::distance(leant.rotation * glm::dvec3(0, 0, 1), normal), 1e-14);
  EXPECT_LT(normal.z, 0.999);  // the body does lean
}

TEST(VirtualScan, RejectsPlacesWithoutGround) {
  const Ground& ground = sample_world().terrain.ground();
  const auto refusal = [&](const SensorPlace& place) -> std::string {
    try {
      pose_at(place, ground);
    } catch (const Error& fault) {
      return fault.what();
    }
    return "";
  };
  SensorPlace place = rest();
  place.at_m = {500, 0};
  EXPECT_THAT(refusal(place), HasSubstr("no ground at (500.000, 0.000)"));
  place = rest();
  place.height_m = 0;
  EXPECT_THAT(refusal(place), HasSubstr("must be > 0"));
}

// The oracle is the output of `generate` for an equivalent scene file.
TEST(VirtualScan, MatchesAGeneratedScanBitForBit) {
  for (const char* lidar : {"preset: velodyne_vlp16, range_noise_sigma_m: 0.03, no_returns: report",
                            "file: lamp.yaml, range_noise_sigma_m: 0.01, error_bound: report"}) {
    const groundray::testing::TemporaryFolder folder;
    const auto scene = write_scene_at_rest(folder.path(), sample_world(), lidar);
    groundray::generate(scene, folder / "out", {});
    const Simulation simulation = load_simulation(scene);
    LidarSpec spec = simulation.lidars[0].spec.lidar;
    if (spec.light) spec.light->sun = load_lidar(folder / "lamp.yaml").light->sun;
    const Pose X_DS = pose_at(rest(), simulation.terrain.ground());
    SceneScanner scanner(simulation);
    const PlacedScan placed = scanner.scan(spec, X_DS);
    EXPECT_TRUE(placed.notes.empty());
    EXPECT_NEAR(std::chrono::duration<double>(placed.stamp).count(), 0, 3e-4);
    const PointCloud generated = read_ply(folder / "out/lidar/top/000000.ply").cloud;
    EXPECT_GT(generated.rows(), 500U);
    EXPECT_EQ(difference(placed.scan.echoes, generated), "") << lidar;
  }
}

// The oracle is the output of `generate` for a scene of that DEM with an equivalent material.
TEST(VirtualScan, TreatsABareDemAsGreyGround) {
  for (const char* lidar : {"preset: velodyne_vlp16, range_noise_sigma_m: 0.03",
                            "file: lamp.yaml, range_noise_sigma_m: 0.01"}) {
    const groundray::testing::TemporaryFolder folder;
    const auto scene = write_scene_at_rest(folder.path(), sample_world(), lidar);
    std::ofstream(folder / "grey.yaml")
        << "groundray_material: 1\nname: grey\nspectrum:\n"
           "  wavelengths_nm: [300, 2500]\n  reflectances: [0.3, 0.3]\n"
           "sources: {all: made up}\n";
    std::ofstream(folder / "scene.yaml")
        << "groundray: 1\nseed: 0\nduration_s: 0.2\n"
           "terrain: {dem: hills.asc, material: grey.yaml}\nplatform: {trajectory: body.tum}\n"
           "lidars:\n  - {name: top, mount: {}, "
        << lidar << "}\n";
    groundray::generate(scene, folder / "out", {});
    const LidarSpec spec = load_simulation(scene).lidars[0].spec.lidar;
    const Simulation simulation = simulation_of_dem(folder / "hills.asc");
    const PlacedScan placed =
        SceneScanner(simulation).scan(spec, pose_at(rest(), simulation.terrain.ground()));
    EXPECT_EQ(placed.notes.size(), spec.light ? 1U : 0U);
    const PointCloud generated = read_ply(folder / "out/lidar/top/000000.ply").cloud;
    EXPECT_GT(generated.rows(), 500U);
    EXPECT_EQ(difference(placed.scan.echoes, generated), "") << lidar;
  }
}

TEST(VirtualScan, NeedsNoMaterials) {
  const groundray::testing::TemporaryFolder folder;
  std::string text = groundray::testing::sample_scene();
  text.erase(text.find("cameras:"));
  text.erase(text.find("material: dry_soil, "), 20);
  const Simulation simulation =
      load_simulation(groundray::testing::write_sample_scene(folder.path(), text));
  std::ofstream(folder / "lamp.yaml") << lamp;
  const PlacedScan placed =
      SceneScanner(simulation)
          .scan(load_lidar(folder / "lamp.yaml"), pose_at(rest(), simulation.terrain.ground()));
  ASSERT_EQ(placed.notes.size(), 1U);
  EXPECT_THAT(placed.notes[0], HasSubstr("only rays"));
  EXPECT_FALSE(placed.scan.echoes.has("amplitude"));
  EXPECT_GT(placed.scan.echoes.rows(), 500U);
}

TEST(VirtualScan, ReportsProgress) {
  std::vector<double> shares;
  const Pose X_DS = pose_at(rest(), sample_world().terrain.ground());
  SceneScanner(sample_world())
      .scan(sample_world().lidars[0].spec.lidar, X_DS, {},
            [&](double share, const std::string& step) {
              shares.push_back(share);
              EXPECT_FALSE(step.empty());
            });
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.front(), 0);
  EXPECT_EQ(shares.back(), 1);
}

TEST(VirtualScan, StopsIfRequestedBeforehand) {
  std::stop_source stop;
  stop.request_stop();
  const Pose X_DS = pose_at(rest(), sample_world().terrain.ground());
  EXPECT_THROW(SceneScanner(sample_world())
                   .scan(sample_world().lidars[0].spec.lidar, X_DS, stop.get_token()),
               Interrupted);
}

// Scans are stopped during a sweep, at different times; complete scans afterwards are unchanged. A
// sweep reports its progress at every hundredth or, if that is coarser, at each of its chunks: at
// least 64 times.
TEST(VirtualScan, StopsDuringASweep) {
  const std::vector<SensorPreset> presets = lidar_presets();
  const auto os1 = std::ranges::find(presets, "ouster_os1_128", &SensorPreset::name);
  ASSERT_NE(os1, presets.end());
  const Pose X_DS = pose_at(rest(), sample_world().terrain.ground());
  SceneScanner scanner(sample_world());
  const PlacedScan first = scanner.scan(os1->lidar, X_DS);
  const PlacedScan whole = scanner.scan(os1->lidar, X_DS);
  EXPECT_EQ(difference(first.scan.echoes, whole.scan.echoes), "");
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    std::stop_source stop;
    double reported = 0;
    const double stop_at = 0.95 * round / rounds;
    EXPECT_THROW(scanner.scan(os1->lidar, X_DS, stop.get_token(),
                              [&](double share, const std::string&) {
                                reported = share;
                                if (share >= stop_at) stop.request_stop();
                              }),
                 Interrupted);
    EXPECT_GE(reported, stop_at);
    EXPECT_LT(reported, 1);
  }
  EXPECT_EQ(difference(scanner.scan(os1->lidar, X_DS).scan.echoes, whole.scan.echoes), "");
}

}  // namespace
}  // namespace groundray::virtual_scan_test
