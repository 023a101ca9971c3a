#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "core/geometry/grid_frame.h"
#include "core/tracing/passes/facet_hit.h"
#include "core/tracing/passes/leaf_hit.h"
#include "core/tracing/passes/level_view.h"

namespace groundray::passes {

/// Writes the highest point of each leaf of a level.
struct HighPointPass {
  static constexpr char name[] = "HighPointPass";

  LevelView level;
  float* high_m;  ///< by leaf; -infinity if it has no height

  void operator()(std::size_t index) const noexcept {
    const Leaf& leaf = level.leaves[index];
    const LeafCells cells{level, leaf, level.step_exponent};
    float high = -std::numeric_limits<float>::infinity();
    for (int row = 0; row <= cells.rows; ++row) {
      for (int column = 0; column <= cells.columns; ++column) {
        const float height = cells.height_m({column, row});
        high = height > high ? height : high;
      }
    }
    high_m[index] = high;
  }
};

/// A ray in D, as passes take it.
struct TracedRay {
  glm::dvec3 origin{0};  ///< metres
  glm::dvec3 direction{0, 0, -1};
  double far_m = std::numeric_limits<double>::infinity();  ///< hits beyond it are ignored
};

/// Traces rays through one level: an index is a ray. Levels may be traced in any order. After all
/// of them, the hits are those of exact tracing (RayTracer), byte for byte.
struct TraceLevelPass {
  static constexpr char name[] = "TraceLevelPass";

  GridFrame frame;
  GroundExtent ground;
  LevelView level;
  std::uint32_t number = 0;       ///< of the level
  const float* high_m = nullptr;  ///< of its leaves, by HighPointPass
  const TracedRay* rays = nullptr;
  Crossing* hits = nullptr;  ///< the nearest so far

  void operator()(std::size_t index) const noexcept {
    const TracedRay& traced = rays[index];
    const FacetRay ray(frame.to_grid(traced.origin, traced.direction), ground, 0, traced.far_m);
    Crossing best = hits[index];
    const RayPart window =
        part_over(ray, level.first, {level.last.x - level.first.x, level.last.y - level.first.y});
    walk_block(ray, window, level.first, level.last, level.block_exponent, level.blocks,
               [&](int column, int row, const RayPart& part) {
                 if (part.in_m > best.range_m) return true;
                 const Leaf* const leaf = level.leaf_of({column, row});
                 if (leaf != nullptr && !passes_above(ray, part, high_m[leaf - level.leaves])) {
                   const LeafCells cells{level, *leaf, level.deciding_exponent(*leaf)};
                   hit_cells(ray, part, cells, {0, 0}, {cells.columns, cells.rows}, number, best);
                 }
                 return false;
               });
    hits[index] = best;
  }

 private:
  static bool passes_above(const FacetRay& ray, const RayPart& part, double high_m) noexcept {
    const double least_m = high_m + 2 * ray.largest_slack_m(part.out_m);
    return ray.grid.z0 + part.in_m * ray.grid.dz > least_m &&
           ray.grid.z0 + part.out_m * ray.grid.dz > least_m;
  }
};

}  // namespace groundray::passes
