#include "core/tracing/level_scene.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <utility>

#include "core/tracing/device.h"

namespace groundray {
namespace {

// Number of a leaf's triangles. Each point omitted on a thinned side merges two of them.
std::size_t count_triangles(const LeafCells& cells) {
  const bool plain = cells.leaf.coarser == 0 && !cells.leaf.has_holes;
  auto count = 2 * static_cast<std::size_t>(cells.columns) * static_cast<std::size_t>(cells.rows);
  for (int j = 0; j <= cells.rows && !plain; ++j) {
    for (int i = 0; i <= cells.columns; ++i) {
      count -= cells.drops({i, j}) ? 1 : 0;
      if (!cells.leaf.has_holes || i == cells.columns || j == cells.rows) continue;
      const Cell cell = cells.cell(i, j);
      for (const Half half : {Half::Near, Half::Far})
        count -= std::isnan(cell.plane(half).height_m) ? 1 : 0;
    }
  }
  return count;
}

void map_leaves(LevelScene::Impl& level) {
  const Level& in = level.level;
  level.first = in.first;
  level.last = glm::min(in.first + (in.heights.size() - 1) * in.step, in.frame.samples - 1);
  level.points = in.heights.size();
  level.heights_m = in.heights.heights_m().data();
  level.leaf_cells = in.leaf_cells;
  level.leaves = in.leaves.data();
  level.step_exponent = std::countr_zero(static_cast<unsigned>(in.step));
  level.block_exponent =
      level.step_exponent + std::countr_zero(static_cast<unsigned>(in.leaf_cells));
  const int side = 1 << level.block_exponent;
  level.blocks = (level.last - in.first - 1) / side + 1;
  level.block_leaves.assign(
      static_cast<std::size_t>(level.blocks.x) * static_cast<std::size_t>(level.blocks.y), -1);
  level.leaf_of_block = level.block_leaves.data();
  for (std::size_t n = 0; n < in.leaves.size(); ++n) {
    const Leaf& leaf = in.leaves[n];
    const glm::ivec2 low = (glm::ivec2(leaf.column, leaf.row) - in.first) / side;
    const glm::ivec2 high = glm::min(low + leaf.step / in.step, level.blocks);
    for (int y = low.y; y < high.y; ++y) {
      for (int x = low.x; x < high.x; ++x) {
        level.block_leaves[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.blocks.x) +
                           static_cast<std::size_t>(x)] = static_cast<std::int32_t>(n);
      }
    }
    level.deviation_m = std::max(level.deviation_m, leaf.deviation_m);
    level.bridging_leaves += leaf.bridges() ? 1 : 0;
    level.triangle_count += count_triangles({level, leaf});
  }
}

struct PlaceOrder {
  bool operator()(glm::ivec2 a, glm::ivec2 b) const { return a.y != b.y ? a.y < b.y : a.x < b.x; }
};

// The leaves of each part: those whose first sample lies in it.
std::map<glm::ivec2, std::vector<Leaf>, PlaceOrder> by_part(const Level& level) {
  std::map<glm::ivec2, std::vector<Leaf>, PlaceOrder> parts;
  const int side = level.part_cells * level.step;
  for (const Leaf& leaf : level.leaves)
    parts[side == 0 ? glm::ivec2(0) : glm::ivec2(leaf.column, leaf.row) / side].push_back(leaf);
  return parts;
}

// Highest of `high_m` and a row's samples from `begin` to `end`, both included; holes are ignored.
float highest(const HeightArray& heights, int row, int begin, int end, float high_m) {
  const float* const samples =
      heights.heights_m().data() + static_cast<std::ptrdiff_t>(row) * heights.size().x;
#pragma omp simd reduction(max : high_m)
  for (int column = begin; column <= end; ++column)
    high_m = samples[column] > high_m ? samples[column] : high_m;
  return high_m;
}

}  // namespace

MaxHeights::MaxHeights(const HeightArray& heights) : tiles_((heights.size() - 2) / tile_cells + 1) {
  heights_m_.reserve(static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y));
  const glm::ivec2 last = heights.size() - 1;
  for (int top = 0; top < last.y; top += tile_cells) {
    for (int left = 0; left < last.x; left += tile_cells) {
      float high_m = -std::numeric_limits<float>::infinity();
      for (int row = top; row <= std::min(top + tile_cells, last.y); ++row)
        high_m = highest(heights, row, left, std::min(left + tile_cells, last.x), high_m);
      heights_m_.push_back(high_m);
    }
  }
}

LevelScene::Impl::Impl(const RayDevice& with, Level content, const glm::dvec3& origin, Tracing how,
                       const Impl* previous)
    : device(with), level(std::move(content)), p_DL(origin), tracing(how) {
  map_leaves(*this);
  max_heights = MaxHeights(level.heights);
  const bool empty = std::isnan(level.heights.min_m());
  const glm::dvec3 a = point_L(level.first.x, level.first.y, empty ? 0 : level.heights.min_m());
  const glm::dvec3 b = point_L(last.x, last.y, empty ? 0 : level.heights.max_m());
  slack_m = static_cast<float>(16 * 0x1p-24 * glm::length(glm::max(glm::abs(a), glm::abs(b))));
  make_parts(previous);
  if (parts.size() == 1) {
    rtcRetainScene(parts.front()->scene.get());
    scene.reset(parts.front()->scene.get());
  } else {
    std::vector<RTCScene> scenes;
    for (const auto& part : parts) scenes.push_back(part->scene.get());
    scene = instance_all(device, scenes);
  }
  check(device, "building a level");
}

// Reuses the parts of `previous` that have the same leaves and sufficient slack, and builds the
// others.
void LevelScene::Impl::make_parts(const Impl* previous) {
  std::map<glm::ivec2, std::shared_ptr<const LevelPart>, PlaceOrder> known;
  if (previous != nullptr && previous->p_DL == p_DL && previous->tracing == tracing &&
      previous->level.step == level.step && previous->level.part_cells == level.part_cells &&
      previous->level.has_quads == level.has_quads) {
    for (const auto& part : previous->parts) known[part->place] = part;
  }
  auto leaves_of = by_part(level);
  std::vector<std::pair<std::size_t, glm::ivec2>> missing;
  for (const auto& [place, list] : leaves_of) {
    const auto part = known.find(place);
    const bool serves =
        part != known.end() && part->second->leaves == list && slack_m <= part->second->slack_m;
    if (!serves) missing.emplace_back(parts.size(), place);
    parts.push_back(serves ? part->second : nullptr);
  }
  tbb::parallel_for(std::size_t{0}, missing.size(), [&](std::size_t n) {
    const auto& [index, place] = missing[n];
    parts[index] = build_part(*this, place, std::move(leaves_of.find(place)->second));
  });
}

LevelScene::LevelScene(const RayDevice& device, Level level, const glm::dvec3& p_DL,
                       Tracing tracing, const LevelScene* previous)
    : impl_(std::make_shared<const Impl>(device, std::move(level), p_DL, tracing,
                                         previous != nullptr ? &previous->impl() : nullptr)) {}

const Level& LevelScene::level() const noexcept { return impl_->level; }
const glm::dvec3& LevelScene::p_DL() const noexcept { return impl_->p_DL; }
Tracing LevelScene::tracing() const noexcept { return impl_->tracing; }
float LevelScene::deviation_m() const noexcept { return impl_->deviation_m; }
std::size_t LevelScene::triangle_count() const noexcept { return impl_->triangle_count; }
std::size_t LevelScene::bridging_leaves() const noexcept { return impl_->bridging_leaves; }

}  // namespace groundray
