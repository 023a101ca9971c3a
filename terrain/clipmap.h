#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "core/ray_tracer.h"
#include "terrain/sensor_box.h"
#include "terrain/tile_source.h"

namespace groundray {

/// How finely terrain is meshed round a viewer.
struct ClipmapSettings {
  double tolerance_m = 0;  ///< vertical deviation that is allowed everywhere
  double angle_rad = 0;    ///< and for each metre of distance from the sensors; both 0: full detail
  /// What the levels may take in all, bytes: samples, Embree's vertices and trees. Windows shrink
  /// to fit; Level::leaves then say what deviation is left.
  std::size_t memory_bytes = std::numeric_limits<std::size_t>::max();
  double reach_m = 0;  ///< no sensor is farther from its frame's viewpoint, in plan
};

/// Square windows of a terrain, nested round a viewer: level l's says where cells of 2^l cells of
/// the DEM may be the finest. What a clipmap holds follows from settings and sensors alone,
/// whatever others came before. Immutable; copies share everything; any number of threads may read
/// one.
///
/// Windows are aligned to pairs of their nodes, and so to the nodes of the next level; each lies
/// inside the next; the outermost is the whole DEM. They are as large as the deviations of the DEM
/// ask for at the settings' tolerance, and as small as their memory demands.
/// @see Losasso, Hoppe, Geometry clipmaps (2004).
class Clipmap {
 public:
  /// @param frame  of the DEM that `source` serves.
  /// @throws Error if a setting is negative or not a number, the memory too small for any window,
  ///         or a tile cannot be read.
  Clipmap(std::shared_ptr<const TileSource> source, const GridFrame& frame,
          const ClipmapSettings& settings, const SensorBox& sensors);

  /// Returns the clipmap for other sensors. Whatever stays in view is shared with this one; only
  /// tiles that come into view are read, and those that a motion on would bring next are asked for
  /// in advance.
  /// @throws Error if a tile cannot be read.
  Clipmap moved_to(const SensorBox& sensors) const;

  /// Returns what tracing needs: the surface round the sensors, finest level first.
  const std::vector<Level>& levels() const noexcept { return levels_; }

 private:
  struct Plan;    // what follows from the settings alone
  struct Window;  // a level's tiles and what is assembled from them

  Clipmap(std::shared_ptr<const Plan> plan, const SensorBox& sensors, const Clipmap* before);
  void select_leaves(const SensorBox& sensors);

  std::shared_ptr<const Plan> plan_;
  SensorBox sensors_;
  std::vector<std::shared_ptr<const Window>> windows_;  // by level; null below the finest
  std::vector<Level> levels_;
};

}  // namespace groundray
