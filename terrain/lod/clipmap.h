#pragma once

#include <cstddef>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "core/tracing/level.h"
#include "terrain/lod/quadtree.h"
#include "terrain/lod/tile_source.h"

namespace groundray {

/// Bounding box of the positions of a frame's sensors, in D. Its centre is the viewpoint.
struct SensorBox {
  glm::dvec3 low_m{0}, high_m{0};
};

/// Returns the bound of a mesh that is seen from `sensors`, in the coordinates of its grid.
inline MeshBound bound_from(const SensorBox& sensors, const GridFrame& frame, double tolerance_m,
                            double angle_rad) {
  const glm::dvec2 cell_m = glm::abs(frame.step_m);
  const glm::dvec2 a = frame.to_grid(glm::dvec2(sensors.low_m)) * cell_m;
  const glm::dvec2 b = frame.to_grid(glm::dvec2(sensors.high_m)) * cell_m;
  return {.tolerance_m = tolerance_m,
          .angle_rad = angle_rad,
          .low_m = {glm::min(a, b), sensors.low_m.z},
          .high_m = {glm::max(a, b), sensors.high_m.z},
          .cell_m = cell_m};
}

/// Tolerances and memory limit of a clipmap.
struct ClipmapSettings {
  double tolerance_m = 0;  ///< vertical deviation permitted everywhere
  double angle_rad = 0;    ///< and per metre of distance from the sensors; both 0: full resolution
  /// Memory limit for all levels, bytes: samples, Embree's vertices and BVHs. Windows shrink to
  /// fit; Level::leaves then report the deviation that results.
  std::size_t memory_bytes = std::numeric_limits<std::size_t>::max();
  double reach_m = 0;  ///< largest horizontal distance of a sensor from its frame's viewpoint
};

/// Windows of a terrain, nested around a viewer. The window of level l is the region in which cells
/// of level l, 2^l DEM cells wide, may be the finest. The content of a clipmap depends only on
/// settings and sensors, never on earlier clipmaps. Immutable; copies share all data; any number of
/// threads may read one.
///
/// Windows are aligned to pairs of their nodes, and thus to the nodes of the next level. Each lies
/// inside the next; the outermost is the whole DEM. Their size follows from the deviations of the
/// DEM and the tolerances, and is reduced as far as the memory limit requires.
/// @see Losasso, Hoppe, Geometry clipmaps (2004); docs/theory/terrain.md.
class Clipmap {
 public:
  /// @param frame  grid of the DEM that `source` provides.
  /// @throws Error if a setting is negative or not finite, if the memory is too small for any
  ///         window, or if a tile cannot be read.
  Clipmap(std::shared_ptr<const TileSource> source, const GridFrame& frame,
          const ClipmapSettings& settings, const SensorBox& sensors, const PassRunner& runner = {});

  /// Returns the clipmap for other sensor positions. Data that stay in view are shared with this
  /// clipmap. Only tiles that come into view are read; those that the same motion would need next
  /// are prefetched.
  /// @throws Error if a tile cannot be read.
  Clipmap moved_to(const SensorBox& sensors, const PassRunner& runner = {}) const;

  /// Returns the levels to trace, the surface around the sensors, finest first.
  const std::vector<Level>& levels() const noexcept { return levels_; }
  /// Returns the quadtree whose leaves the levels have.
  const Selection& selection() const noexcept { return selection_; }

 private:
  struct Plan;    // everything that follows from the settings alone
  struct Window;  // tiles of a level and the arrays assembled from them

  Clipmap(std::shared_ptr<const Plan> plan, const SensorBox& sensors, const Clipmap* before,
          const PassRunner& runner);
  void select_leaves(const PassRunner& runner);

  std::shared_ptr<const Plan> plan_;
  SensorBox sensors_;
  std::vector<std::shared_ptr<const Window>> windows_;  // by level; null below the finest
  Selection selection_;
  std::vector<Level> levels_;
};

}  // namespace groundray
