#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "core/tracing/embree_adapter.h"
#include "core/tracing/passes/leaf_hit.h"
#include "core/tracing/passes/level_view.h"
#include "core/tracing/ray_tracer.h"

namespace groundray {

/// Geometry IDs in the scene of a level.
inline constexpr unsigned block_geometry = 0;
inline constexpr unsigned facet_geometry = 1;

/// Greatest height of each tile of 64 x 64 cells, boundary points included; holes are ignored.
class MaxHeights {
 public:
  MaxHeights() = default;
  explicit MaxHeights(const HeightArray& heights);

  /// Returns an upper bound of the surface's height near a point, given in the array's columns and
  /// rows and clamped to them.
  float at(double column, double row) const noexcept {
    const int x = std::clamp(static_cast<int>(column) / tile_cells, 0, tiles_.x - 1);
    const int y = std::clamp(static_cast<int>(row) / tile_cells, 0, tiles_.y - 1);
    return heights_m_[static_cast<std::size_t>(y) * static_cast<std::size_t>(tiles_.x) +
                      static_cast<std::size_t>(x)];
  }

 private:
  static constexpr int tile_cells = 64;
  glm::ivec2 tiles_{0};
  std::vector<float> heights_m_;
};

/// A triangle of the surface, identified by its cell.
struct Facet {
  std::int32_t column = 0, row = 0;  // the cell's first sample, in the DEM
  std::int8_t step_exponent = 0;     // the cell is 2^this cells of the DEM wide and high
  Half half = Half::Near;
  float deviation_m = 0;
};

/// Facet that a triangle primitive of Embree represents.
struct TriangleFacet {
  Facet facet;
  bool whole = false;  // true if it is half of an ordinary cell: its plane is intersected directly
};

/// Block of ordinary cells that a grid or quad primitive of Embree represents.
struct CellBlock {
  std::int32_t column = 0, row = 0;    // its first sample, in the DEM
  std::int8_t step_exponent = 0;       // of the cells used in double precision
  std::int32_t columns = 0, rows = 0;  // number of those cells
  float deviation_m = 0;
};

/// A part of a level in Embree. Embree keeps pointers to it, so it must not move once built.
struct LevelPart {
  LevelPart() = default;
  LevelPart(const LevelPart&) = delete;
  LevelPart& operator=(const LevelPart&) = delete;

  Owned<RTCScene> scene;
  glm::ivec2 place{0};  // column and row of the part
  std::vector<Leaf> leaves;
  std::vector<CellBlock> blocks;  // by primitive
  std::vector<TriangleFacet> triangles;

  int groups_exponent = 0;  // exact tracing only: a leaf is 2^this x 2^this groups of cells
  float slack_m = 0;        // exact tracing only: padding of the groups' bounding boxes
  const LevelScene::Impl* built_for = nullptr;  // only while it is being built
};

/// Builds the part of `level` that consists of `leaves`.
std::shared_ptr<const LevelPart> build_part(const LevelScene::Impl& level, glm::ivec2 place,
                                            std::vector<Leaf> leaves);

/// Data of a level for queries in double precision, and its parts in Embree.
struct LevelScene::Impl : LevelView {
  Impl(const RayDevice& with, Level content, const glm::dvec3& origin, Tracing how,
       const Impl* previous);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  RayDevice device;
  Level level;
  glm::dvec3 p_DL{0};
  Tracing tracing = Tracing::Fast;
  Owned<RTCScene> scene;  // that of the only part, or instances of all parts
  std::vector<std::shared_ptr<const LevelPart>> parts;

  std::vector<std::int32_t> block_leaves;  // leaf_of_block
  float deviation_m = 0;
  std::size_t triangle_count = 0;
  std::size_t bridging_leaves = 0;
  MaxHeights max_heights;
  float slack_m = 0;  // 16 * 2^-24 * max|p_L|: bound of rounding to float

  void make_parts(const Impl* previous);
  /// Returns the position of a sample in L.
  glm::dvec3 point_L(int column, int row, double height_m) const noexcept {
    return glm::dvec3(level.frame.to_D({column, row}), height_m) - p_DL;
  }
};

/// A ray as used for one level: in double, and in float from where it enters the level's bounding
/// box.
struct LevelRay {
  FacetRay facet;
  double enter_m = 0;
  double leave_m = 0;
  glm::vec3 origin{0};  ///< in L
  glm::vec3 direction{0};
  float far_m = 0;  ///< from the float origin
};

/// Returns a component of a direction in float, with tiny components set to 0. Embree computes the
/// reciprocal of a component below 1e-18 in magnitude as if it were +1e-18. It then loses rays with
/// a negative component if rays of the same packet have a positive one.
inline float direction_float(double component) noexcept {
  return std::abs(component) < 2e-18 ? 0.0F : static_cast<float>(component);
}

/// Returns an upper bound in float of a range in double, with `slack_m` added.
inline float far_float(double range_m, float slack_m) noexcept {
  return static_cast<float>(range_m) * (1 + 0x1p-20f) + slack_m;
}

}  // namespace groundray
