#include "apps/scene/paths.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/io/tum_io.h"
#include "terrain/ground_path.h"

namespace groundray {

std::chrono::nanoseconds run_time(const SceneSpec& spec) {
  return std::chrono::nanoseconds(std::llround(spec.duration_s * 1e9));
}

std::int64_t whole_sweeps(const ScanPattern& pattern, const SceneSpec& spec) {
  return static_cast<std::int64_t>(std::floor(spec.duration_s * pattern.sweep_rate_hz() + 1e-9));
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
  std::vector<Trajectory::Sample> samples = read_tum(path.tum).samples();
  for (auto& [time, X_WB] : samples) {
    time -= begin;
    X_WB.translation_m -= terrain.header().origin_w_m;
  }
  return Trajectory(std::move(samples));
}

Trajectory driven_path(const DrivenPath& path, const Terrain& terrain,
                       std::chrono::nanoseconds duration) {
  GroundPathSpec drive{{}, path.speed_m_s, path.height_m, path.footprint_m, duration};
  for (const glm::dvec2& p_W : path.waypoints_m)
    drive.waypoints_m.push_back(p_W - glm::dvec2(terrain.header().origin_w_m));
  return build_ground_path(terrain.ground(), drive);
}

}  // namespace groundray
