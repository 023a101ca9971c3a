#include "terrain/terrain_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace groundray {
namespace {

constexpr int leaf_cells = Certificate::block_cells;

struct Content {
  bool any = false;
  bool all = true;
  float high_m = -std::numeric_limits<float>::infinity();
};

Content content(const HeightGrid& grid, glm::ivec2 low, glm::ivec2 high) {
  Content found;
  for (int row = low.y; row <= high.y; ++row) {
    for (int column = low.x; column <= high.x; ++column) {
      const bool hole = std::isnan(grid.height_m(column, row));
      found.any |= !hole;
      found.all &= !hole;
      found.high_m = std::max(found.high_m, grid.height_m(column, row));
    }
  }
  return found;
}

// Heights are compared by address: clipmaps share those that did not change.
bool is_same(const Level& a, const Level& b) {
  return a.first == b.first && a.step == b.step && a.has_quads == b.has_quads &&
         a.heights.heights_m().data() == b.heights.heights_m().data() && a.leaves == b.leaves;
}

}  // namespace

Level full_resolution_level(const HeightGrid& grid, double memory_bytes) {
  const glm::ivec2 last(grid.columns() - 1, grid.rows() - 1);
  Level level{
      .frame = grid.frame(),
      .heights = grid.samples(),
      .leaf_cells = leaf_cells,
      .has_quads = quad_cell_bytes * last.x * last.y <= std::min(memory_bytes, most_quad_bytes)};
  for (int row = 0; row < last.y; row += leaf_cells) {
    for (int column = 0; column < last.x; column += leaf_cells) {
      const glm::ivec2 low(column, row);
      const Content found = content(grid, low, glm::min(low + leaf_cells, last));
      if (found.any) level.leaves.push_back({column, row, 1, 0, !found.all, 0, found.high_m});
    }
  }
  return level;
}

RayTracer build_tracer(const Clipmap& clipmap, const glm::dvec3& p_DL, Tracing tracing,
                       const RayTracer* previous) {
  const RayDevice device = previous != nullptr ? previous->device() : RayDevice();
  std::vector<LevelScene> scenes;
  for (const Level& level : clipmap.levels()) {
    const LevelScene* known = nullptr;
    if (previous != nullptr) {
      for (const LevelScene& scene : previous->levels()) {
        if (scene.level().step == level.step) known = &scene;
      }
    }
    const bool same = known != nullptr && known->p_DL() == p_DL && known->tracing() == tracing &&
                      is_same(known->level(), level);
    scenes.push_back(same ? *known : LevelScene(device, level, p_DL, tracing, known));
  }
  return {device, std::move(scenes)};
}

}  // namespace groundray
