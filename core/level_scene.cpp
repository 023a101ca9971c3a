#include "core/level_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "core/error.h"

namespace groundray {
namespace {

constexpr int tile_cells = 8;  // side of a user primitive in exact tracing

glm::dvec3 sample_L(const LevelScene& level, int column, int row, double height_m) noexcept {
  const HeightGrid& grid = level.level.grid;
  return glm::dvec3(grid.origin_m() + glm::dvec2(column, row) * grid.step_m(), height_m) -
         level.p_DL;
}

// Reports the first crossing of one tile's cells for each ray of a packet, in double.
void intersect_tile(const RTCIntersectFunctionNArguments* arguments) {
  const auto& level = *static_cast<const LevelScene*>(arguments->geometryUserPtr);
  const auto& query = *reinterpret_cast<const ExactQuery*>(arguments->context);
  const glm::dvec2 low = glm::dvec2(level.tiles[arguments->primID]) - 0.5;
  const glm::dvec2 high = low + glm::dvec2(tile_cells + 1);
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  RTCHitN* const hits = RTCRayHitN_HitN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned lane = RTCRayN_id(rays, arguments->N, i);
    const LevelRay& ray = query.rays[lane];
    Crossing& best = query.crossings[lane];
    double begin_m = ray.enter_m;
    double end_m = std::min(ray.leave_m, best.range_m);
    clip_range(ray.grid.u0, ray.grid.du, low.x, high.x, begin_m, end_m);
    clip_range(ray.grid.v0, ray.grid.dv, low.y, high.y, begin_m, end_m);
    if (!(begin_m <= end_m)) continue;
    const auto crossing = level.level.grid.first_crossing(ray.grid, begin_m, end_m);
    if (!crossing || !(crossing->range_m < best.range_m)) continue;
    best = *crossing;
    // The float range only prunes: Embree may go on a little beyond the true one, never stop before
    // it.
    float& far_m = RTCRayN_tfar(rays, arguments->N, i);
    far_m = std::min(far_m, far_float(best.range_m - ray.enter_m, level.slack_m));
    RTCHitN_geomID(hits, arguments->N, i) = arguments->geomID;
    RTCHitN_primID(hits, arguments->N, i) = arguments->primID;
  }
}

void tile_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& level = *static_cast<const LevelScene*>(arguments->geometryUserPtr);
  const HeightGrid& grid = level.level.grid;
  const glm::ivec2 first = level.tiles[arguments->primID];
  const glm::ivec2 last = glm::min(first + tile_cells, glm::ivec2(grid.columns(), grid.rows()) - 1);
  float low_m = std::numeric_limits<float>::infinity();
  float high_m = -low_m;
  for (int row = first.y; row <= last.y; ++row) {
    for (int column = first.x; column <= last.x; ++column) {
      low_m = std::min(low_m, grid.height_m(column, row));
      high_m = std::max(high_m, grid.height_m(column, row));
    }
  }
  const glm::dvec3 a = sample_L(level, first.x, first.y, low_m);
  const glm::dvec3 b = sample_L(level, last.x, last.y, high_m);
  const glm::vec3 low = glm::vec3(glm::min(a, b)) - level.slack_m;
  const glm::vec3 high = glm::vec3(glm::max(a, b)) + level.slack_m;
  RTCBounds& bounds = *arguments->bounds_o;
  bounds.lower_x = low.x;
  bounds.lower_y = low.y;
  bounds.lower_z = low.z;
  bounds.upper_x = high.x;
  bounds.upper_y = high.y;
  bounds.upper_z = high.z;
}

// The tiles that hold a part of the level.
std::vector<glm::ivec2> occupied_tiles(const Level& level) {
  const glm::ivec2 count =
      (glm::ivec2(level.grid.columns(), level.grid.rows()) - 2) / tile_cells + 1;
  std::vector<bool> occupied(static_cast<std::size_t>(count.x) * static_cast<std::size_t>(count.y));
  const auto mark = [&](glm::ivec2 tile) {
    occupied[static_cast<std::size_t>(tile.y) * static_cast<std::size_t>(count.x) +
             static_cast<std::size_t>(tile.x)] = true;
  };
  for (const Level::Block& block : level.blocks) {
    const glm::ivec2 first = glm::ivec2(block.column, block.row) / tile_cells;
    const glm::ivec2 last =
        glm::ivec2(block.column + block.columns - 2, block.row + block.rows - 2) / tile_cells;
    for (int row = first.y; row <= last.y; ++row) {
      for (int column = first.x; column <= last.x; ++column) mark({column, row});
    }
  }
  for (const Facet& facet : level.facets) mark(glm::ivec2(facet.column, facet.row) / tile_cells);
  std::vector<glm::ivec2> tiles;
  for (int row = 0; row < count.y; ++row) {
    for (int column = 0; column < count.x; ++column) {
      if (occupied[static_cast<std::size_t>(row) * static_cast<std::size_t>(count.x) +
                   static_cast<std::size_t>(column)]) {
        tiles.push_back(glm::ivec2(column, row) * tile_cells);
      }
    }
  }
  return tiles;
}

void attach(RTCScene scene, RTCGeometry geometry, unsigned id) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

void build_exact(RTCDevice device, LevelScene& level) {
  level.tiles = occupied_tiles(level.level);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(level.tiles.size()));
  rtcSetGeometryUserData(geometry, &level);
  rtcSetGeometryBoundsFunction(geometry, tile_bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect_tile);
  attach(level.scene, geometry, block_geometry);
}

template <typename T>
T* checked(void* memory) {
  if (memory == nullptr)
    throw Error("ray tracer: there is not enough memory for a level's geometry");
  return static_cast<T*>(memory);
}

RTCBuffer new_vertices(RTCDevice device, const LevelScene& level) {
  const HeightGrid& grid = level.level.grid;
  const auto samples = grid.heights_m().size();
  RTCBuffer vertices =
      rtcNewBuffer(device, samples * sizeof(glm::vec3) + 16);  // Embree reads 16 bytes at a time
  auto* out = checked<glm::vec3>(vertices == nullptr ? nullptr : rtcGetBufferData(vertices));
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const float height_m = grid.height_m(column, row);
      *out++ = glm::vec3(sample_L(level, column, row, std::isnan(height_m) ? 0 : height_m));
    }
  }
  return vertices;
}

void build_fast(RTCDevice device, LevelScene& level) {
  const auto columns = static_cast<unsigned>(level.level.grid.columns());
  const auto samples = level.level.grid.heights_m().size();
  RTCBuffer vertices = new_vertices(device, level);
  if (!level.level.blocks.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_GRID);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices, 0,
                         sizeof(glm::vec3), samples);
    auto* grids =
        checked<RTCGrid>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID,
                                                 sizeof(RTCGrid), level.level.blocks.size()));
    for (const Level::Block& block : level.level.blocks) {
      *grids++ = {static_cast<unsigned>(block.row) * columns + static_cast<unsigned>(block.column),
                  columns, static_cast<unsigned short>(block.columns),
                  static_cast<unsigned short>(block.rows)};
    }
    attach(level.scene, geometry, block_geometry);
  }
  if (!level.level.facets.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices, 0,
                         sizeof(glm::vec3), samples);
    auto* indices = checked<glm::uvec3>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(glm::uvec3), level.level.facets.size()));
    for (const Facet& facet : level.level.facets) {
      const unsigned first =
          static_cast<unsigned>(facet.row) * columns + static_cast<unsigned>(facet.column);
      const unsigned apex = facet.half == Facet::Half::Near ? first : first + columns + 1;
      *indices++ = {apex, first + 1, first + columns};
    }
    attach(level.scene, geometry, facet_geometry);
  }
  rtcReleaseBuffer(vertices);
}

}  // namespace

MaxHeights::MaxHeights(const HeightGrid& grid)
    : tiles_((glm::ivec2(grid.columns(), grid.rows()) - 2) / tile_cells + 1) {
  heights_m_.reserve(static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y));
  for (int top = 0; top < grid.rows() - 1; top += tile_cells) {
    for (int left = 0; left < grid.columns() - 1; left += tile_cells) {
      float high_m = -std::numeric_limits<float>::infinity();
      for (int row = top; row <= std::min(top + tile_cells, grid.rows() - 1); ++row) {
        for (int column = left; column <= std::min(left + tile_cells, grid.columns() - 1);
             ++column) {
          high_m = std::max(high_m, grid.height_m(column, row));
        }
      }
      heights_m_.push_back(high_m);
    }
  }
}

void build_level_scene(RTCDevice device, Tracing tracing, LevelScene& level) {
  const HeightGrid& grid = level.level.grid;
  if (std::isnan(grid.min_height_m())) throw Error("ray tracer: a level has no height at all");
  const glm::dvec3 a = sample_L(level, 0, 0, grid.min_height_m());
  const glm::dvec3 b = sample_L(level, grid.columns() - 1, grid.rows() - 1, grid.max_height_m());
  level.slack_m =
      static_cast<float>(16 * 0x1p-24 * glm::length(glm::max(glm::abs(a), glm::abs(b))));
  level.max_heights = MaxHeights(grid);
  level.scene = rtcNewScene(device);
  rtcSetSceneFlags(level.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(level.scene, RTC_BUILD_QUALITY_MEDIUM);
  if (tracing == Tracing::Exact) {
    build_exact(device, level);
  } else {
    build_fast(device, level);
  }
  rtcCommitScene(level.scene);
}

}  // namespace groundray
