#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "apps/scene/simulation.h"
#include "core/geometry/pose.h"
#include "core/geometry/voxel_grid.h"
#include "core/io/point_cloud.h"
#include "core/tracing/scene.h"

namespace groundray {

/// Flag of each voxel of a grid: 0 or 1.
using VoxelFlags = std::vector<std::uint8_t>;

/// Returns the voxels that contain an echo of a scan, at the point that the lidar reports, as seen
/// from the pose of S at the stamp.
VoxelFlags scanned_voxels(const PlacedLidar& lidar, std::int64_t sweep, const PointCloud& echoes,
                          const VoxelGrid& grid);

/// Flags the voxels that the central rays of a sweep's pulses cross on their way to the first
/// surface, that of its hit included, or to the end of the lidar's range, at most 1000 m.
/// @param scene  of this sweep.
/// @param X_SD   pose of D in the grid's frame.
/// @throws Error as Scene::trace.
void flag_crossed(const PlacedLidar& lidar, std::int64_t sweep, const Scene& scene,
                  const VoxelGrid& grid, const Pose& X_SD, VoxelFlags& crossed);

/// Visibility of voxels from positions: along the line from the centre of a voxel to a position, an
/// occupied voxel hides it. Occupied voxels are hidden by themselves alone.
struct VoxelVisibility {
  VoxelFlags occluded;  ///< 1 if hidden from the first position, or occupied
  VoxelFlags invalid;   ///< 1 if hidden from all positions; 0 if occupied
};

/// Returns the visibility of the voxels.
/// @param labels     0 in voxels that are not occupied.
/// @param positions  at least one, in the grid's frame.
/// @param check      called repeatedly; an exception from it ends the work.
VoxelVisibility visibility_of(const VoxelGrid& grid, std::span<const std::uint16_t> labels,
                              std::span<const glm::dvec3> positions,
                              const std::function<void()>& check);

/// Returns flags in bytes, eight voxels in each, the first in the highest bit.
std::vector<std::uint8_t> packed(std::span<const std::uint8_t> flags);

}  // namespace groundray
