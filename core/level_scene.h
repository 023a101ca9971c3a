#pragma once

#include <algorithm>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/embree_adapter.h"
#include "core/ray_tracer.h"

namespace groundray {

/// Geometry ids in the scene of a level.
inline constexpr unsigned block_geometry = 0;
inline constexpr unsigned facet_geometry = 1;

/// The highest sample of each tile of 64 x 64 cells, its rim included; holes count as lowest.
class MaxHeights {
 public:
  MaxHeights() = default;
  explicit MaxHeights(const HeightGrid& grid);

  /// Returns a height that the surface round a point (grid coordinates, clamped to the grid) does
  /// not exceed.
  float at(double u, double v) const noexcept {
    const int column = std::clamp(static_cast<int>(u) / tile_cells, 0, tiles_.x - 1);
    const int row = std::clamp(static_cast<int>(v) / tile_cells, 0, tiles_.y - 1);
    return heights_m_[static_cast<std::size_t>(row) * static_cast<std::size_t>(tiles_.x) +
                      static_cast<std::size_t>(column)];
  }

 private:
  static constexpr int tile_cells = 64;
  glm::ivec2 tiles_{0};
  std::vector<float> heights_m_;
};

/// A level as Embree holds it. Embree keeps pointers to it: it must not move once built.
struct LevelScene {
  Level level;
  glm::dvec3 p_DL{0};
  RTCScene scene = nullptr;
  std::vector<glm::ivec2> tiles;  ///< first cells of the user primitives of exact tracing
  MaxHeights max_heights;
  float slack_m = 0;  ///< 16 * 2^-24 * max|p_L|: covers rounding to floats
};

/// A ray as tracing one level needs it: in double, and in float from where it enters the level's
/// box.
struct LevelRay {
  GridRay grid;
  double enter_m = 0;
  double leave_m = 0;
  glm::vec3 origin{0};  ///< in L
  glm::vec3 direction{0};
  float far_m = 0;  ///< from the float origin
};

/// The double side of a packet: what exact tracing reads and fills, by lane.
struct ExactQuery {
  QueryContext context;  ///< first, so that Embree's pointer to it is a pointer to this
  const LevelRay* rays;
  Crossing* crossings;
};

/// Builds the scene of `level` for `tracing`: grids and triangles, or tiles that are decided in
/// double.
/// @throws Error if the level has no height.
void build_level_scene(RTCDevice device, Tracing tracing, LevelScene& level);

/// Returns a bound in float for a range in double, never short of it.
inline float far_float(double range_m, float slack_m) noexcept {
  return static_cast<float>(range_m) * (1 + 0x1p-20f) + slack_m;
}

}  // namespace groundray
