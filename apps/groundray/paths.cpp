#include "apps/groundray/paths.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/product_io.h"
#include "terrain/ground_path.h"

namespace groundray {

std::chrono::nanoseconds run_time(const SceneSpec& spec) {
  return std::chrono::nanoseconds(std::llround(spec.duration_s * 1e9));
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
