#pragma once

#include <cstddef>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>

#include "core/geometry/grid_frame.h"

namespace groundray {

/// Box of cubic voxels, numbered along z first, then y, then x. A point on the boundary of two
/// voxels belongs to the upper one.
struct VoxelGrid {
  glm::ivec3 size{1};   ///< number of voxels along each axis
  glm::dvec3 low_m{0};  ///< lowest corner
  double side_m = 1;

  std::size_t count() const noexcept { return index({size.x - 1, size.y - 1, size.z - 1}) + 1; }
  std::size_t index(const glm::ivec3& voxel) const noexcept {
    const auto of = [](int number) { return static_cast<std::size_t>(number); };
    return (of(voxel.x) * of(size.y) + of(voxel.y)) * of(size.z) + of(voxel.z);
  }
  /// Returns the voxel with a number.
  glm::ivec3 voxel(std::size_t index) const noexcept {
    const auto columns = static_cast<std::size_t>(size.z), rows = static_cast<std::size_t>(size.y);
    return {static_cast<int>(index / columns / rows), static_cast<int>(index / columns % rows),
            static_cast<int>(index % columns)};
  }
  bool contains(const glm::ivec3& voxel) const noexcept {
    return glm::clamp(voxel, glm::ivec3(0), size - 1) == voxel;
  }
  /// Returns the lowest corner of a voxel, which may be outside the grid.
  glm::dvec3 corner_m(const glm::ivec3& voxel) const noexcept {
    return low_m + side_m * glm::dvec3(voxel);
  }
  glm::dvec3 centre_m(const glm::ivec3& voxel) const noexcept {
    return low_m + side_m * (glm::dvec3(voxel) + 0.5);
  }
  /// Returns the voxel of a point, which may be outside the grid if it is near it.
  glm::ivec3 nearby(const glm::dvec3& p) const noexcept {
    return {glm::floor((p - low_m) / side_m)};
  }
  /// Returns the voxel that contains a point; nothing outside the grid.
  std::optional<glm::ivec3> voxel_at(const glm::dvec3& p) const noexcept {
    const glm::dvec3 at = (p - low_m) / side_m;
    for (glm::length_t axis = 0; axis < 3; ++axis)
      if (!(at[axis] >= 0 && at[axis] < size[axis])) return std::nullopt;
    return nearby(p);
  }
};

/// Calls `act(voxel)` for the voxels of the grid that a segment crosses, in order from `from` to
/// `to`, until it returns false. At an edge of voxels, one of those that it touches is visited.
/// @see Amanatides, Woo, A fast voxel traversal algorithm for ray tracing (1987).
template <typename Act>
void walk_voxels(const VoxelGrid& grid, const glm::dvec3& from, const glm::dvec3& to,
                 const Act& act) {
  const glm::dvec3 along = to - from, high_m = grid.corner_m(grid.size);
  double begin = 0, end = 1;
  for (glm::length_t axis = 0; axis < 3; ++axis)
    clip_range(from[axis], along[axis], grid.low_m[axis], high_m[axis], begin, end);
  if (!(begin <= end)) return;
  glm::ivec3 voxel = glm::clamp(grid.nearby(from + begin * along), glm::ivec3(0), grid.size - 1);
  const auto leaves_at = [&](glm::length_t axis) {
    if (along[axis] == 0) return std::numeric_limits<double>::infinity();
    const int plane = voxel[axis] + (along[axis] > 0 ? 1 : 0);
    return (grid.low_m[axis] + grid.side_m * plane - from[axis]) / along[axis];
  };
  glm::dvec3 leaves(leaves_at(0), leaves_at(1), leaves_at(2));
  while (act(voxel)) {
    glm::length_t axis = leaves.y < leaves.x ? 1 : 0;
    if (leaves.z < leaves[axis]) axis = 2;
    if (leaves[axis] > end) return;
    voxel[axis] += along[axis] > 0 ? 1 : -1;
    if (voxel[axis] < 0 || voxel[axis] >= grid.size[axis]) return;
    leaves[axis] = leaves_at(axis);
  }
}

}  // namespace groundray
