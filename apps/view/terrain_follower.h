#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <memory>
#include <stop_token>

#include "apps/scene/world.h"
#include "apps/view/layer.h"

namespace groundray {

/// How finely terrain is drawn.
struct TerrainDrawing {
  double angle_rad = 2.5e-4;        ///< deviation allowed for each metre of distance
  std::size_t triangles = 600'000;  ///< the angle is doubled until there are no more, about
  std::size_t memory_bytes = std::size_t{512} << 20U;  ///< at most, for its windows
};

/// Terrain as it is drawn from one viewpoint.
struct FollowedTerrain {
  /// "terrain", as terrain_layer has it; of a scene whose ground has materials with "colour" as
  /// well. Its `coarse` is the same for a wider angle.
  Layer layer;
  std::size_t triangles = 0, leaves = 0;
  int levels = 0;
  std::size_t memory_bytes = 0;  ///< of the clipmap's samples and of what is drawn
  double rebuild_s = 0;          ///< what this took
  double angle_rad = 0;          ///< that was kept
  bool is_angle_kept = true;     ///< false: far out only as far as the memory went
};

/// The quadtree and clipmap of a terrain for viewpoints that move.
class TerrainFollower {
 public:
  /// Of an opened scene, with its relief.
  /// @param stop  asks for an end of the certification that a large DEM needs.
  /// @throws Error as Terrain. @throws Interrupted if it was asked to stop.
  explicit TerrainFollower(std::shared_ptr<const World> world, const TerrainDrawing& drawing = {},
                           const std::stop_token& stop = {});
  /// Of a DEM file alone; one that is placed by angles is warped to its UTM zone.
  /// @throws Error, Interrupted likewise.
  explicit TerrainFollower(const std::filesystem::path& dem, const TerrainDrawing& drawing = {},
                           const std::stop_token& stop = {});
  ~TerrainFollower();
  TerrainFollower(const TerrainFollower&) = delete;
  TerrainFollower& operator=(const TerrainFollower&) = delete;

  /// Returns the terrain for a viewpoint: what it shows is a function of that alone. Any thread may
  /// call, one at a time; what stays in view is taken over from the call before.
  /// @throws Error if a tile cannot be read.
  FollowedTerrain follow(const glm::dvec3& viewpoint_w_m);

  /// Where D lies in W.
  const glm::dvec3& origin_w_m() const;
  /// Returns a place from which the whole terrain can be overlooked, in W.
  glm::dvec3 overview_w_m() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace groundray
