#include "apps/groundray/voxels/visible_voxels.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>

#include "sensors/lidar/pattern/scan_pattern.h"
#include "terrain/lod/pass.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

nanoseconds nanoseconds_of(double seconds) { return nanoseconds(std::llround(1e9 * seconds)); }

// Rays of some pulses of a sweep.
std::vector<Ray> central_rays(const PlacedLidar& lidar, std::int64_t sweep, std::int64_t begin,
                              std::int64_t end, double far_m) {
  PulseBatch batch;
  lidar.lidar.pattern().fill(sweep, begin, end, batch);
  std::vector<Ray> rays(batch.size());
  for (const PulseBatch::Volley& volley : batch.volleys) {
    const nanoseconds time = nanoseconds_of(volley.time_s);
    const Pose X_DS = lidar.X_DS.pose_at(time);
    for (std::size_t i = volley.begin; i < volley.end; ++i) {
      rays[i] = {.origin = X_DS * batch.origin_m[i],
                 .direction = X_DS.rotation * batch.direction[i],
                 .far_m = far_m,
                 .time = time};
    }
  }
  return rays;
}

// Returns whether a voxel that is not occupied is hidden from a position.
bool is_hidden(const VoxelGrid& grid, std::span<const std::uint16_t> labels,
               const glm::ivec3& voxel, const glm::dvec3& position) {
  bool is_hidden = false;
  walk_voxels(grid, grid.centre_m(voxel), position, [&](const glm::ivec3& on_line) {
    is_hidden = labels[grid.index(on_line)] != 0;
    return !is_hidden;
  });
  return is_hidden;
}

}  // namespace

VoxelFlags scanned_voxels(const PlacedLidar& lidar, std::int64_t sweep, const PointCloud& echoes,
                          const VoxelGrid& grid) {
  const nanoseconds stamp = lidar.lidar.pattern().stamp(sweep);
  const Pose X_SD = inverse(lidar.X_DS.pose_at(stamp));
  const bool are_as_fired = lidar.spec.lidar.points == LidarSpec::Points::AsFired;
  const auto x = echoes.column<float>("x"), y = echoes.column<float>("y"),
             z = echoes.column<float>("z"), time_s = echoes.column<float>("time");
  VoxelFlags flags(grid.count(), 0);
  for (std::size_t i = 0; i < echoes.rows(); ++i) {
    glm::dvec3 p_S(x[i], y[i], z[i]);
    if (are_as_fired)
      p_S = X_SD * (lidar.X_DS.pose_at(stamp + nanoseconds_of(double{time_s[i]})) * p_S);
    if (const auto voxel = grid.voxel_at(p_S)) flags[grid.index(*voxel)] = 1;
  }
  return flags;
}

void flag_crossed(const PlacedLidar& lidar, std::int64_t sweep, const Scene& scene,
                  const VoxelGrid& grid, const Pose& X_SD, VoxelFlags& crossed) {
  constexpr std::int64_t at_once = 4096;
  constexpr double farthest_m = 1000;
  const double far_m = std::min(farthest_m, lidar.spec.lidar.gate.far_m);
  const std::int64_t pulses = lidar.lidar.pattern().pulses(sweep);
  const auto blocks = static_cast<std::size_t>((pulses + at_once - 1) / at_once);
  run_pass(run_in_parallel, blocks, [&](std::size_t block) {
    const std::int64_t begin = at_once * static_cast<std::int64_t>(block);
    const std::vector<Ray> rays =
        central_rays(lidar, sweep, begin, std::min(pulses, begin + at_once), far_m);
    std::vector<Hit> hits(rays.size());
    scene.trace(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const glm::dvec3 end = rays[i].origin + std::min(far_m, hits[i].range_m) * rays[i].direction;
      walk_voxels(grid, X_SD * rays[i].origin, X_SD * end, [&](const glm::ivec3& voxel) {
        std::atomic_ref(crossed[grid.index(voxel)]).store(1, std::memory_order_relaxed);
        return true;
      });
    }
  });
}

VoxelVisibility visibility_of(const VoxelGrid& grid, std::span<const std::uint16_t> labels,
                              std::span<const glm::dvec3> positions,
                              const std::function<void()>& check) {
  VoxelVisibility visibility{VoxelFlags(labels.size(), 0), VoxelFlags(labels.size(), 0)};
  const auto layer = static_cast<std::size_t>(grid.size.y) * static_cast<std::size_t>(grid.size.z);
  for (std::size_t k = 0; k < positions.size(); ++k) {
    check();
    run_pass(run_in_parallel, static_cast<std::size_t>(grid.size.x), [&](std::size_t x) {
      for (std::size_t i = x * layer; i < (x + 1) * layer; ++i) {
        if (labels[i] != 0) {
          visibility.occluded[i] = 1;
        } else if (k == 0) {
          const bool is_occluded = is_hidden(grid, labels, grid.voxel(i), positions[k]);
          visibility.occluded[i] = visibility.invalid[i] = is_occluded ? 1 : 0;
        } else if (visibility.invalid[i] != 0) {
          visibility.invalid[i] = is_hidden(grid, labels, grid.voxel(i), positions[k]) ? 1 : 0;
        }
      }
    });
  }
  return visibility;
}

std::vector<std::uint8_t> packed(std::span<const std::uint8_t> flags) {
  std::vector<std::uint8_t> bytes((flags.size() + 7) / 8, 0);
  for (std::size_t i = 0; i < flags.size(); ++i)
    bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] | (flags[i] & 1U) << (7 - i % 8));
  return bytes;
}

}  // namespace groundray
