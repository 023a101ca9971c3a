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

#include "core/embree_adapter.h"
#include "core/ray_tracer.h"

namespace groundray {

/// Geometry ids in the scene of a level.
inline constexpr unsigned block_geometry = 0;
inline constexpr unsigned facet_geometry = 1;

/// The highest point of each tile of 64 x 64 points, its rim included; holes count as lowest.
class MaxHeights {
 public:
  MaxHeights() = default;
  explicit MaxHeights(const HeightArray& heights);

  /// Returns a height that the surface round a point does not exceed. The point is counted in the
  /// array's columns and rows, and clamped to them.
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

/// A triangle of the surface by its cell.
struct Facet {
  std::int32_t column = 0, row = 0;  // the cell's first sample, in the DEM
  std::int8_t step_exponent = 0;     // the cell is 2^this cells of the DEM wide and high
  Half half = Half::Near;
  float deviation_m = 0;
};

/// What one triangle of Embree's stands for.
struct TriangleFacet {
  Facet facet;
  bool whole = false;  // half of an ordinary cell, so its plane can be met at once
};

/// What one grid of Embree's stands for: ordinary cells.
struct GridBlock {
  std::int32_t column = 0, row = 0;    // its first sample, in the DEM
  std::int8_t step_exponent = 0;       // of the cells that decide
  std::int32_t columns = 0, rows = 0;  // how many of those
  float deviation_m = 0;
};

/// A part of a level as Embree holds it. Embree keeps pointers to it: it does not move once built.
struct LevelPart {
  LevelPart() = default;
  ~LevelPart();
  LevelPart(const LevelPart&) = delete;
  LevelPart& operator=(const LevelPart&) = delete;

  RTCScene scene = nullptr;
  glm::ivec2 place{0};  // which part of the DEM
  std::vector<Leaf> leaves;
  std::vector<GridBlock> grids;  // by primitive
  std::vector<TriangleFacet> triangles;

  // Exact tracing alone:
  struct Area {
    glm::ivec2 first{0}, last{0};  // samples of the DEM
  };
  std::vector<Area> areas;                      // of the leaves
  float slack_m = 0;                            // by how much their boxes are padded
  const LevelScene::Impl* built_for = nullptr;  // while it is built
};

/// Builds a part of `level` that consists of `leaves`.
std::shared_ptr<const LevelPart> build_part(const LevelScene::Impl& level, glm::ivec2 place,
                                            std::vector<Leaf> leaves);

/// A level as double arithmetic looks things up, and its parts.
struct LevelScene::Impl {
  Impl(const RayDevice& with, Level content, const glm::dvec3& origin, Tracing how,
       const Impl* previous);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  RayDevice device;
  Level level;
  glm::dvec3 p_DL{0};
  Tracing tracing = Tracing::Fast;
  RTCScene scene = nullptr;  // of the only part, or of all parts as instances
  std::vector<std::shared_ptr<const LevelPart>> parts;

  glm::ivec2 last{0};  // the DEM's sample at the window's last point
  int step_exponent = 0;
  int block_exponent = 0;  // a block is the finest leaf: 2^this cells of the DEM
  glm::ivec2 blocks{0};
  std::vector<std::int32_t> leaf_of_block;  // -1 outside the level's leaves
  float deviation_m = 0;
  std::size_t triangle_count = 0;
  std::size_t bridging_leaves = 0;
  MaxHeights max_heights;
  float slack_m = 0;  // 16 * 2^-24 * max|p_L|: covers rounding to floats

  void make_parts(const Impl* previous);
  bool contains(int column, int row) const noexcept {  // a cell of the DEM
    return level.first.x <= column && column < last.x && level.first.y <= row && row < last.y;
  }
  /// The height of a sample of the DEM that is a point of the level.
  float height_m(int column, int row) const noexcept {
    return level.heights(
        column == last.x ? level.heights.size().x - 1 : (column - level.first.x) >> step_exponent,
        row == last.y ? level.heights.size().y - 1 : (row - level.first.y) >> step_exponent);
  }
  const Leaf* leaf_at(int column, int row) const noexcept {
    const int x = (column - level.first.x) >> block_exponent;
    const int y = (row - level.first.y) >> block_exponent;
    const std::int32_t leaf =
        leaf_of_block[static_cast<std::size_t>(y) * static_cast<std::size_t>(blocks.x) +
                      static_cast<std::size_t>(x)];
    return leaf < 0 ? nullptr : &level.leaves[static_cast<std::size_t>(leaf)];
  }
  /// The exponent of the cells that decide in a leaf: the level's own where the leaf does not
  /// deviate, so that its ranges are those of the full resolution to the last bit.
  int deciding_exponent(const Leaf& leaf) const noexcept {
    return leaf.deviation_m == 0 && !leaf.has_holes
               ? step_exponent
               : std::countr_zero(static_cast<unsigned>(leaf.step));
  }
  /// The cell of 2^exponent cells of the DEM in a leaf that holds a cell of the DEM; thinned sides
  /// are heeded if the cells are the leaf's own.
  Cell cell_at(const Leaf& leaf, int exponent, int column, int row) const noexcept;
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

/// Where a ray crosses the surface from above.
struct Crossing {
  double range_m = std::numeric_limits<double>::infinity();
  FacetPlane plane;
  float deviation_m = 0;
  std::uint32_t level = 0;
};

/// Returns a component of a direction in float. Embree takes the reciprocal of anything below 1e-18
/// for that of +1e-18, and then loses rays whose component is negative, if rays of the same packet
/// have a positive one: such components are 0.
inline float direction_float(double component) noexcept {
  return std::abs(component) < 2e-18 ? 0.0F : static_cast<float>(component);
}

/// Returns a bound in float for a range in double, never short of it.
inline float far_float(double range_m, float slack_m) noexcept {
  return static_cast<float>(range_m) * (1 + 0x1p-20f) + slack_m;
}

}  // namespace groundray
