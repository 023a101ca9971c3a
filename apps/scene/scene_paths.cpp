#include <fmt/format.h>

#include <algorithm>
#include <glm/vec2.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/scene_place.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/tum_io.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "terrain/ground_path.h"
#include "terrain/trail/trails.h"

namespace groundray {
namespace {

Trajectory read_recorded(const RecordedPath& path) {
  return located(path.where, "key 'trajectory'", [&] {
    return path.text.empty() ? read_tum(path.tum) : parse_tum(path.text, path.tum.string());
  });
}

}  // namespace

std::chrono::nanoseconds begin_time(const RecordedPath& path) {
  return read_recorded(path).begin_time();
}

Trajectory extended(const Trajectory& path, const SceneSpec& spec) {
  std::chrono::nanoseconds more(1);
  for (const MountedLidar& lidar : spec.lidars) {
    const ScanPattern pattern(lidar.lidar.pattern);
    const std::int64_t sweeps = whole_sweeps(pattern, spec);
    if (sweeps > 0)
      more = std::max(
          more, pattern.last_firing(sweeps - 1) - run_time(spec) + std::chrono::nanoseconds(1));
  }
  std::vector<Trajectory::Sample> samples = path.samples();
  const auto [time, X_DB] = samples.back();
  Pose onwards;
  if (samples.size() > 1) {
    const auto& [time_before, X_DB_before] = samples[samples.size() - 2];
    onwards =
        Screw(inverse(X_DB_before) * X_DB).at(in_seconds(more) / in_seconds(time - time_before));
  }
  samples.push_back({time + more, X_DB * onwards});
  return Trajectory(std::move(samples));
}

Trajectory recorded_path(const RecordedPath& path, const Terrain& terrain,
                         std::chrono::nanoseconds begin) {
  std::vector<Trajectory::Sample> samples = read_recorded(path).samples();
  for (auto& [time, X_WB] : samples) {
    time -= begin;
    X_WB.translation_m -= terrain.header().origin_w_m;
  }
  return Trajectory(std::move(samples));
}

Trajectory driven_path(const DrivenPath& path, const Terrain& terrain,
                       std::chrono::nanoseconds duration) {
  const glm::dvec2 origin_w_m(terrain.header().origin_w_m);
  GroundPathSpec drive{.waypoints_m = {},
                       .speed_m_s = path.speed_m_s,
                       .height_m = path.height_m,
                       .footprint_m = path.footprint_m,
                       .duration = duration,
                       .origin_w_m = origin_w_m,
                       .from_m = path.from_m};
  const bool is_trail = !path.trail.empty();
  const std::vector<glm::dvec2>& waypoints_w_m =
      is_trail ? terrain.relief()->trails()->named(path.trail).spec().waypoints_m
               : path.waypoints_m;
  for (const glm::dvec2& p_W : waypoints_w_m) drive.waypoints_m.push_back(p_W - origin_w_m);
  return located(path.where, is_trail ? "key 'trail'" : "key 'waypoints_m'", [&] {
    const auto outside = std::ranges::find_if(
        waypoints_w_m, [&](glm::dvec2 p_W) { return !is_on_dem(terrain, p_W); });
    if (outside == waypoints_w_m.end()) return build_ground_path(terrain.ground(), drive);
    const std::string rule = fmt::format("waypoint {}, ({}, {}), is outside the DEM: {}",
                                         outside - waypoints_w_m.begin() + 1, outside->x,
                                         outside->y, dem_extent(terrain, *outside));
    if (outside == waypoints_w_m.begin()) throw Error(rule);
    try {
      return build_ground_path(terrain.ground(), drive);  // the drive may end before
    } catch (const Error& fault) {
      throw Error("{}\n  {}", fault.what(), rule);
    }
  });
}

}  // namespace groundray
