#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/common.hpp>
#include <map>
#include <vector>

#include "apps/scene/simulation.h"
#include "core/geometry/pose.h"
#include "core/geometry/triangle_box.h"
#include "core/geometry/voxel_grid.h"
#include "core/tracing/scene.h"

namespace groundray {

/// Grid of SemanticKITTI, in the frame S of a lidar.
/// @see Behley and others, SemanticKITTI (2019): 51.2 m ahead, 25.6 m to each side, from 2 m below
///      the lidar to 4.4 m above it.
inline constexpr VoxelGrid semantic_kitti_grid{
    .size = {256, 256, 32}, .low_m = {0, -25.6, -2}, .side_m = 0.2};

/// Label in files of each label of a scene; none of them is 0.
using VoxelLabelMap = std::map<std::uint16_t, std::uint16_t>;

/// Triangle with its label, in the frame of a grid, or its part in a voxel.
struct VoxelPart {
  std::uint32_t voxel = 0;  ///< its number
  std::uint16_t label = 0;
  double area_m2 = 0;
};

/// Adds the parts of a triangle in the voxels that it overlaps.
/// @param label_at  returns the label of the surface at a point of the triangle.
template <typename LabelAt>
void add_parts(const VoxelGrid& grid, const Corners& triangle, const LabelAt& label_at,
               std::vector<VoxelPart>& parts) {
  constexpr double slack = 1e-6;  // of a voxel: candidates, which overlaps_box decides
  const glm::dvec3 lowest = glm::min(glm::min(triangle[0], triangle[1]), triangle[2]);
  const glm::dvec3 highest = glm::max(glm::max(triangle[0], triangle[1]), triangle[2]);
  const glm::dvec3 high_m = grid.corner_m(grid.size);
  for (glm::length_t axis = 0; axis < 3; ++axis)
    if (!(lowest[axis] <= high_m[axis] && highest[axis] >= grid.low_m[axis])) return;
  const glm::dvec3 slack_m(slack * grid.side_m);
  const glm::ivec3 last = grid.size - 1;
  const glm::ivec3 first =
      glm::clamp(grid.nearby(glm::max(lowest, grid.low_m) - slack_m), glm::ivec3(0), last);
  const glm::ivec3 end =
      glm::clamp(grid.nearby(glm::min(highest, high_m) + slack_m), glm::ivec3(0), last);
  for (int x = first.x; x <= end.x; ++x) {
    for (int y = first.y; y <= end.y; ++y) {
      for (int z = first.z; z <= end.z; ++z) {
        const glm::ivec3 voxel(x, y, z);
        const glm::dvec3 low = grid.corner_m(voxel), high = grid.corner_m(voxel + 1);
        const bool is_inside = first == end && glm::clamp(lowest, low, high) == lowest &&
                               highest.x <= high.x && highest.y <= high.y && highest.z <= high.z;
        if (!is_inside && !overlaps_box(triangle, low, high)) continue;
        const TrianglePart part =
            is_inside ? whole_part(triangle) : part_in_box(triangle, low, high);
        parts.push_back(
            {static_cast<std::uint32_t>(grid.index(voxel)), label_at(part.centroid), part.area});
      }
    }
  }
}

/// Areas of the labels in the voxels of a grid.
class VoxelAreas {
 public:
  explicit VoxelAreas(std::size_t voxels) : voxels_(voxels) {}

  /// Adds parts, in order.
  void add(const std::vector<VoxelPart>& parts);
  /// Returns the label with the largest area in each voxel, the smallest one if areas are equal; 0
  /// in voxels without any part.
  std::vector<std::uint16_t> labels() const;

 private:
  std::size_t voxels_;
  std::map<std::uint16_t, std::vector<double>> areas_m2_;  // by label; negative without any part
};

/// Returns the labels of the voxels that the ground or an object of a scene overlaps at a time,
/// boundaries included, and 0 in all others. Equal for any number of threads.
/// @param X_SD   pose of D in the grid's frame.
/// @param check  called repeatedly; an exception from it ends the work.
std::vector<std::uint16_t> label_voxels(const Simulation& simulation, const Scene& scene,
                                        const VoxelGrid& grid, const Pose& X_SD,
                                        std::chrono::nanoseconds time, const VoxelLabelMap& map,
                                        const std::function<void()>& check);

}  // namespace groundray
