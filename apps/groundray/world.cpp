#include "apps/groundray/world.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/product_io.h"
#include "sensors/spec_io.h"
#include "terrain/ground_path.h"

namespace groundray {
namespace {

std::chrono::nanoseconds run_time(const SceneSpec& spec) {
  return std::chrono::nanoseconds(std::llround(spec.duration_s * 1e9));
}

double seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

Trajectory lay_path(const RecordedPath& path, const SceneSpec& spec, const Dem& dem) {
  std::vector<Trajectory::Sample> samples = read_tum(path.tum).samples();
  const auto begin = samples.front().time;
  for (auto& [time, X_WB] : samples) {
    time -= begin;
    X_WB.translation_m -= dem.origin_w_m;
  }
  if (samples.back().time < run_time(spec)) {
    throw Error(
        "{}: the trajectory lasts {:.3f} s but the scene's duration_s is {} s; record longer or "
        "run shorter",
        path.tum.string(), seconds(samples.back().time), spec.duration_s);
  }
  return Trajectory(std::move(samples));
}

Trajectory lay_path(const DrivenPath& path, const SceneSpec& spec, const Dem& dem) {
  constexpr std::chrono::milliseconds margin{10};
  GroundPathSpec drive{
      {}, path.speed_m_s, path.height_m, path.footprint_m, run_time(spec) + margin};
  for (const glm::dvec2& p_W : path.waypoints_m)
    drive.waypoints_m.push_back(p_W - glm::dvec2(dem.origin_w_m));
  return build_ground_path(dem.grid, drive);
}

void check_above_ground(const PlacedLidar& placed, const Dem& dem) {
  for (const auto& [time, X_DS] : placed.X_DS.samples()) {
    const glm::dvec3 p_DS = X_DS.translation_m;
    const auto ground_m = dem.grid.height_m_at(glm::dvec2(p_DS));
    if (!ground_m || p_DS.z > *ground_m) continue;
    throw Error(
        "lidar '{}': at {:.3f} s it is {:.3f} m below the ground, at ({:.3f}, {:.3f}, {:.3f}) m in "
        "W; raise its "
        "mount or the platform's height, or check that the trajectory and the DEM share a vertical "
        "datum",
        placed.spec.name, seconds(time), *ground_m - p_DS.z, p_DS.x + dem.origin_w_m.x,
        p_DS.y + dem.origin_w_m.y, p_DS.z + dem.origin_w_m.z);
  }
}

// The sweeps that begin within the run and whose every beam fires while the trajectory lasts.
// Sweeps of a sensor that runs free end a little after their turn, so a drive is laid a little
// longer than the run.
std::int64_t whole_sweeps(const PlacedLidar& placed, double duration_s) {
  const double turns = duration_s * placed.spec.lidar.pattern.rate_hz;
  auto sweeps = static_cast<std::int64_t>(std::floor(turns + 1e-9));
  while (sweeps > 0 && placed.lidar.pattern().last_firing(sweeps - 1) > placed.X_DS.end_time())
    --sweeps;
  return sweeps;
}

}  // namespace

std::filesystem::path data_folder() {
  if (const char* chosen = std::getenv("GROUNDRAY_DATA")) return chosen;
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  auto installed = program.parent_path().parent_path() / "share/groundray";
  if (std::filesystem::exists(installed / "sensors", ignored)) return installed;
  return GROUNDRAY_SOURCE_DATA;
}

World load_world(const std::filesystem::path& scene) {
  SceneSpec spec = load_scene(scene, data_folder() / "sensors");
  Dem dem = load_dem(spec.terrain.dem, spec.terrain.options);
  Trajectory X_DB =
      std::visit([&](const auto& path) { return lay_path(path, spec, dem); }, spec.platform);
  std::vector<PlacedLidar> lidars;
  for (const MountedLidar& mounted : spec.lidars) {
    PlacedLidar placed{mounted, Lidar(mounted.lidar), X_DB.mounted(mounted.X_BS), 0};
    placed.sweeps = whole_sweeps(placed, spec.duration_s);
    if (placed.sweeps == 0) {
      throw Error(
          "lidar '{}': a run of {} s is shorter than one sweep at {} Hz; lengthen duration_s",
          mounted.name, spec.duration_s, mounted.lidar.pattern.rate_hz);
    }
    check_above_ground(placed, dem);
    lidars.push_back(std::move(placed));
  }
  return {std::move(spec), std::move(dem), std::move(X_DB), std::move(lidars)};
}

}  // namespace groundray
