#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <stop_token>

#include "apps/scene/simulation.h"
#include "apps/view/rendering/layer.h"
#include "core/tracing/level.h"

namespace groundray {

/// Returns the approximate number of triangles in the leaves of levels. It includes triangles that
/// holes and thinned sides remove.
std::size_t count_triangles(std::span<const Level> levels);

/// Returns the layer "terrain" of a clipmap: its triangles as they are traced
/// (docs/theory/terrain.md), with the sides of leaves thinned towards coarser neighbours.
///
/// Point column: "height". Cell columns: "slope", "clipmap level" (the window that contains the
/// triangle), "cell size" (of its leaf, as a power of two) and "certified deviation" (largest
/// vertical distance of its leaf from the reference surface).
/// @param levels      finest first.
/// @param origin_w_m  origin of D, in W.
/// @param near_m      point in D near which the layer's floats are most precise.
Layer terrain_layer(std::span<const Level> levels, const glm::dvec3& origin_w_m,
                    const glm::dvec3& near_m);

/// Level of detail of displayed terrain.
struct TerrainDrawing {
  double angle_rad = 2.5e-4;        ///< permitted deviation per metre of distance
  std::size_t triangles = 600'000;  ///< approximate limit, kept by doubling the angle
  std::size_t memory_bytes = std::size_t{512} << 20U;  ///< limit for the clipmap's windows
};

/// Terrain meshed for one viewpoint.
struct FollowedTerrain {
  /// Layer "terrain", as from terrain_layer(); with the column "colour" if it belongs to a scene
  /// whose ground has materials. Its `coarse` is meshed with a larger angle.
  Layer layer;
  std::size_t triangles = 0, leaves = 0;
  int levels = 0;
  std::size_t memory_bytes = 0;  ///< memory of the clipmap's samples and of the drawn data
  double rebuild_s = 0;          ///< time to build this
  double angle_rad = 0;          ///< permitted deviation per metre of distance, after doublings
  bool is_angle_kept = true;     ///< false: distant terrain exceeds it, for lack of memory
};

/// Quadtree and clipmap of a terrain, for moving viewpoints.
class TerrainFollower {
 public:
  /// Constructs the follower of a scene's terrain, with its relief.
  /// @param stop  requests a stop of the certification that a large DEM requires.
  /// @throws Error as Terrain.
  /// @throws Interrupted if a stop is requested.
  explicit TerrainFollower(std::shared_ptr<const Simulation> simulation,
                           const TerrainDrawing& drawing = {}, const std::stop_token& stop = {});
  /// Constructs the follower of a DEM file. A DEM in geographic coordinates is warped to its UTM
  /// zone.
  /// @throws Error, Interrupted as above.
  explicit TerrainFollower(const std::filesystem::path& dem, const TerrainDrawing& drawing = {},
                           const std::stop_token& stop = {});
  ~TerrainFollower();
  TerrainFollower(const TerrainFollower&) = delete;
  TerrainFollower& operator=(const TerrainFollower&) = delete;

  /// Returns the terrain meshed for a viewpoint. The displayed result depends on the viewpoint
  /// alone. Any thread may call this; concurrent calls run one after another. Parts that remain in
  /// use are taken from the previous call.
  /// @throws Error if a tile cannot be read.
  FollowedTerrain follow(const glm::dvec3& viewpoint_w_m);

  /// Returns the origin of D, in W.
  const glm::dvec3& origin_w_m() const;
  /// Returns a viewpoint, in W, from which the whole terrain is visible.
  glm::dvec3 overview_w_m() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace groundray
