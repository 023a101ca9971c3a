#include "apps/scene/simulation.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>
#include <variant>

#include "apps/scene/certifying.h"
#include "apps/scene/paths.h"
#include "apps/scene/readers/spec_io.h"
#include "apps/scene/source_folder.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/tum_io.h"

namespace groundray {
namespace {

// Returns the platform's trajectory in D, from time 0 on; sets `begin` to that time on the
// recorder's clock.
Trajectory lay_platform_path(const RecordedPath& path, const SceneSpec& spec,
                             const Terrain& terrain, std::chrono::nanoseconds& begin) {
  begin = read_tum(path.tum).begin_time();
  Trajectory X_DB = recorded_path(path, terrain, begin);
  if (X_DB.end_time() < run_time(spec)) {
    throw Error(
        "{}: the trajectory lasts {:.3f} s but the scene's duration_s is {} s; record longer or "
        "run shorter",
        path.tum.string(), in_seconds(X_DB.end_time()), spec.duration_s);
  }
  return X_DB;
}

Trajectory lay_platform_path(const DrivenPath& path, const SceneSpec& spec, const Terrain& terrain,
                             std::chrono::nanoseconds& /*begin*/) {
  return driven_path(path, terrain, run_time(spec));
}

// Returns the distance of a point from the DEM's rectangle, in plan, m.
double distance_m(const GridFrame& frame, const glm::dvec3& p) {
  const glm::dvec2 a = frame.origin_m;
  const glm::dvec2 b = frame.to_D(frame.samples - 1);
  return glm::distance(glm::clamp(glm::dvec2(p), glm::min(a, b), glm::max(a, b)), glm::dvec2(p));
}

// Checks a sensor every 10 ms of the run: it must be above ground, and at least once within reach
// of the DEM.
void check_place(const std::string& sensor, const Trajectory& X_DS, double reach_m,
                 const Terrain& terrain, std::chrono::nanoseconds run) {
  bool in_reach = false;
  for (std::chrono::nanoseconds time{0}; time <= run; time += std::chrono::milliseconds(10)) {
    const glm::dvec3 p_DS = X_DS.pose_at(time).translation_m;
    in_reach |= distance_m(terrain.frame(), p_DS) <= reach_m;
    const auto ground_m = terrain.ground().height_m_at(glm::dvec2(p_DS));
    if (!ground_m || p_DS.z > *ground_m) continue;
    const glm::dvec3 p_WS = p_DS + terrain.header().origin_w_m;
    throw Error(
        "{}: at {:.3f} s it is {:.3f} m below the ground, at ({:.3f}, {:.3f}, {:.3f}) m in W; "
        "raise its mount or the platform's height, or check that the trajectory and the DEM share "
        "a vertical datum",
        sensor, in_seconds(time), *ground_m - p_DS.z, p_WS.x, p_WS.y, p_WS.z);
  }
  if (in_reach) return;
  const glm::dvec3 p_DS = X_DS.samples().front().pose.translation_m;
  const glm::dvec3 p_WS = p_DS + terrain.header().origin_w_m;
  throw Error(
      "{}: it starts at ({:.3f}, {:.3f}) m in W, {:.0f} m from the DEM, and never comes within "
      "{:.0f} m of it; is the trajectory in the DEM's CRS, {}?",
      sensor, p_WS.x, p_WS.y, distance_m(terrain.frame(), p_DS), reach_m,
      terrain.header().crs_name);
}

// Returns the length of the DEM's diagonal. A camera has no range; if it is farther from the DEM
// than this, the trajectory is assumed to be wrong.
double diagonal_m(const GridFrame& frame) {
  return glm::distance(frame.to_D({0, 0}), frame.to_D(frame.samples - 1));
}

double largest_reach_m(const std::vector<PlacedLidar>& lidars,
                       const std::vector<PlacedCamera>& cameras) {
  double reach_m = 0;
  const auto look = [&](const Exposed& frame) {
    const SensorBox box = sensor_box(frame);
    reach_m = std::max(reach_m, glm::distance(glm::dvec2(box.low_m), glm::dvec2(box.high_m)) / 2);
  };
  for (const PlacedLidar& lidar : lidars) {
    for (std::int64_t sweep = 0; sweep < lidar.sweeps; ++sweep) look(exposed(lidar, sweep));
  }
  for (const PlacedCamera& camera : cameras) {
    for (std::size_t i = 0; i < camera.begins.size(); ++i)
      look(exposed(camera, static_cast<std::int64_t>(i)));
  }
  return reach_m;
}

std::vector<PlacedLidar> place_lidars(const SceneSpec& spec, const Trajectory& X_DB) {
  std::vector<PlacedLidar> lidars;
  for (const MountedLidar& mounted : spec.lidars) {
    Lidar lidar(mounted.lidar, spec.air);
    const std::int64_t sweeps = whole_sweeps(lidar.pattern(), spec);
    if (sweeps == 0) {
      throw Error(
          "lidar '{}': a run of {} s is shorter than one sweep at {} Hz; lengthen duration_s",
          mounted.name, spec.duration_s, lidar.pattern().sweep_rate_hz());
    }
    lidars.push_back({mounted, std::move(lidar), X_DB.mounted(mounted.X_BS), sweeps});
  }
  return lidars;
}

std::optional<Sky> load_sky(const SceneSpec& spec) {
  if (!spec.sky) return std::nullopt;
  const auto* environment = std::get_if<EnvironmentImage>(&spec.sky->dome);
  return Sky(*spec.sky, environment != nullptr ? read_image_f(environment->image) : ImageF());
}

// Returns the program or shared library that contains this code: the Python module has its data
// next to it.
std::filesystem::path own_file() {
  Dl_info info{};
  static const char here = 0;
  return dladdr(&here, &info) != 0 && info.dli_fname != nullptr ? info.dli_fname : "";
}

std::optional<AerialPerspective> air_of(const SceneSpec& spec) {
  const AerialPerspective air(spec.air);
  return air.extinction_per_m() == glm::dvec3(0) ? std::nullopt : std::optional(air);
}

}  // namespace

Exposed exposed(const PlacedLidar& lidar, std::int64_t sweep) {
  const ScanPattern& pattern = lidar.lidar.pattern();
  return {&lidar.X_DS, pattern.stamp(sweep), pattern.last_firing(sweep)};
}

Exposed exposed(const PlacedCamera& camera, std::int64_t image) {
  const std::chrono::nanoseconds begin = camera.begins[static_cast<std::size_t>(image)];
  return {&camera.X_DC, begin, begin + camera.camera.duration()};
}

SensorBox sensor_box(const Exposed& frame) {
  constexpr std::chrono::milliseconds spacing(10);
  SensorBox box{glm::dvec3(std::numeric_limits<double>::infinity()),
                glm::dvec3(-std::numeric_limits<double>::infinity())};
  for (std::chrono::nanoseconds time = frame.begin;; time += spacing) {
    time = std::min(time, frame.end);
    const glm::dvec3 p_DS = frame.X_DS->pose_at(time).translation_m;
    box = {glm::min(box.low_m, p_DS), glm::max(box.high_m, p_DS)};
    if (time == frame.end) return box;
  }
}

Exposed first_frame(const Simulation& simulation) {
  return simulation.lidars.empty() ? exposed(simulation.cameras.front(), 0)
                                   : exposed(simulation.lidars.front(), 0);
}

std::filesystem::path data_folder() {
  if (const char* chosen = std::getenv("GROUNDRAY_DATA")) return chosen;
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  for (const auto& folder :
       {own_file().parent_path() / "data", program.parent_path().parent_path() / "share/groundray"})
    if (std::filesystem::exists(folder / "sensors", ignored)) return folder;
  return source_folder() / "data";
}

Simulation load_simulation(const std::filesystem::path& scene, std::optional<Seed> seed) {
  SceneSpec spec = load_scene(scene, data_folder() / "sensors");
  if (seed) spec.seed = *seed;
  Certifying progress;  // shows nothing unless the terrain is certified
  return build_simulation(std::move(spec), [&](double share) { progress.update(share); });
}

Simulation build_simulation(SceneSpec spec, const Terrain::Progress& progress) {
  Terrain terrain(spec.terrain.dem, spec.terrain.options, spec.terrain.detail, progress,
                  spec.terrain.relief);
  std::chrono::nanoseconds begin{0};
  const Trajectory X_DB = extended(
      std::visit([&](const auto& path) { return lay_platform_path(path, spec, terrain, begin); },
                 spec.platform),
      spec);
  std::vector<PlacedLidar> lidars = place_lidars(spec, X_DB);
  std::vector<PlacedCamera> cameras = place_cameras(spec, X_DB);
  for (const auto& [mounted, lidar, X_DS, sweeps] : lidars) {
    check_place(fmt::format("lidar '{}'", mounted.name), X_DS, mounted.lidar.gate.far_m, terrain,
                run_time(spec));
  }
  for (const PlacedCamera& camera : cameras) {
    check_place(fmt::format("camera '{}'", camera.spec.name), camera.X_DC,
                diagonal_m(terrain.frame()), terrain, run_time(spec));
  }
  const double reach_m = largest_reach_m(lidars, cameras);
  SceneObjects content = build_scene_objects(spec, terrain, begin);
  std::optional<Sky> sky = load_sky(spec);
  const std::optional<AerialPerspective> air = air_of(spec);
  return {std::move(spec),    std::move(terrain), begin,
          std::move(lidars),  std::move(cameras), reach_m,
          std::move(content), std::move(sky),     air};
}

}  // namespace groundray
