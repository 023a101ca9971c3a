#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/tracing/device.h"
#include "core/tracing/level_scene.h"
#include "core/tracing/level_surface.h"

namespace groundray {
namespace {

// Embree's primitives, except for their vertices, gathered leaf by leaf. Each leaf has its own
// vertices, so that a leaf of any step is one dense grid.
struct Primitives {
  std::vector<RTCGrid> grids;  // or
  std::vector<glm::uvec4> quads;
  std::vector<glm::uvec3> triangles;
};

// Adds one triangle of a cell, unless a corner has no height. A corner that is omitted on a thinned
// side is replaced by the next point along the boundary.
void add_triangle(const LeafCells& cells, unsigned first_point, glm::ivec2 cell, Half half,
                  bool other_split, LevelPart& out, Primitives& primitives) {
  const glm::ivec2 nw = cell, ne = cell + glm::ivec2(1, 0), sw = cell + glm::ivec2(0, 1),
                   se = cell + 1;
  const bool is_near = half == Half::Near;
  std::array<glm::ivec2, 3> corners =
      other_split ? std::array{nw, se, is_near ? ne : sw} : std::array{ne, sw, is_near ? nw : se};
  bool whole = !other_split && !(cells.leaf.deviation_m == 0 && !cells.leaf.has_holes);
  whole &= cells.column(cell.x + 1) - cells.column(cell.x) == cells.leaf.step &&
           cells.row(cell.y + 1) - cells.row(cell.y) == cells.leaf.step;
  for (glm::ivec2& corner : corners) {
    if (!cells.drops(corner)) continue;
    if (!other_split) return;  // the other cell of the pair adds this triangle
    whole = false;
    const glm::ivec2 inward = cell + cell + 1 - corner;  // diagonally opposite corner of the cell
    corner += cells.drops_in_row(corner) ? glm::ivec2(corner.x - inward.x, 0)
                                         : glm::ivec2(0, corner.y - inward.y);
  }
  glm::uvec3 triangle;
  for (int k = 0; k < 3; ++k) {
    const glm::ivec2 corner = corners[static_cast<std::size_t>(k)];
    if (std::isnan(cells.height_m(corner))) return;
    triangle[k] = first_point + static_cast<unsigned>(corner.y * (cells.columns + 1) + corner.x);
  }
  primitives.triangles.push_back(triangle);
  out.triangles.push_back({{cells.column(cell.x), cells.row(cell.y),
                            static_cast<std::int8_t>(cells.exponent), half, cells.leaf.deviation_m},
                           whole});
}

void write_points(const LeafCells& cells, const LevelScene::Impl& level, glm::vec3* out) {
  for (int j = 0; j <= cells.rows; ++j) {
    for (int i = 0; i <= cells.columns; ++i) {
      const float height_m = cells.height_m({i, j});
      *out++ = glm::vec3(
          level.point_L(cells.column(i), cells.row(j), std::isnan(height_m) ? 0 : height_m));
    }
  }
}

// Returns the cells [low, high) that are neither narrower nor adjacent to a thinned side; none if
// the leaf has holes.
std::pair<glm::ivec2, glm::ivec2> ordinary_cells(const LeafCells& cells) {
  const Leaf& leaf = cells.leaf;
  if (leaf.has_holes) return {glm::ivec2(0), glm::ivec2(0)};
  const auto [columns, rows] = std::pair(cells.columns, cells.rows);
  const bool narrow_x = cells.column(columns) - cells.column(columns - 1) < leaf.step;
  const bool narrow_y = cells.row(rows) - cells.row(rows - 1) < leaf.step;
  const auto inset = [&](Leaf::Side side, bool narrow) {
    return cells.block.thins(side) || narrow ? 1 : 0;
  };
  return {{inset(Leaf::West, false), inset(Leaf::North, false)},
          {columns - inset(Leaf::East, narrow_x), rows - inset(Leaf::South, narrow_y)}};
}

// Adds a block of ordinary cells as one primitive; `size` is 1 for a quad.
void add_block(const LeafCells& cells, unsigned first_point, glm::ivec2 low, glm::ivec2 size,
               bool as_quad, LevelPart& out, Primitives& primitives) {
  const auto stride = static_cast<unsigned>(cells.columns + 1);
  const unsigned nw =
      first_point + static_cast<unsigned>(low.y) * stride + static_cast<unsigned>(low.x);
  if (as_quad) {  // Embree splits it along the diagonal from its second corner to its fourth
    primitives.quads.emplace_back(nw, nw + 1, nw + stride + 1, nw + stride);
  } else {
    primitives.grids.push_back({nw, stride, static_cast<unsigned short>(size.x + 1),
                                static_cast<unsigned short>(size.y + 1)});
  }
  const int exponent = cells.level.deciding_exponent(cells.leaf);
  out.blocks.push_back({cells.column(low.x), cells.row(low.y), static_cast<std::int8_t>(exponent),
                        size.x << (cells.exponent - exponent),
                        size.y << (cells.exponent - exponent), cells.leaf.deviation_m});
}

void add_leaf(const LeafCells& cells, unsigned first_point, bool as_quads, LevelPart& out,
              Primitives& primitives) {
  const auto [low, high] = ordinary_cells(cells);
  const bool has_block = low.x < high.x && low.y < high.y;
  if (has_block && as_quads) {
    for (int j = low.y; j < high.y; ++j)
      for (int i = low.x; i < high.x; ++i)
        add_block(cells, first_point, {i, j}, glm::ivec2(1), true, out, primitives);
  } else if (has_block) {
    add_block(cells, first_point, low, high - low, false, out, primitives);
  }
  for (int j = 0; j < cells.rows; ++j) {
    for (int i = 0; i < cells.columns; ++i) {
      if (has_block && low.x <= i && i < high.x && low.y <= j && j < high.y) {
        i = high.x - 1;  // covered by the block
        continue;
      }
      const Cell cell = cells.cell(i, j);
      const bool other_split = cell.split != Cell::Split::NorthEastToSouthWest;
      add_triangle(cells, first_point, {i, j}, Half::Near, other_split, out, primitives);
      add_triangle(cells, first_point, {i, j}, Half::Far, other_split, out, primitives);
    }
  }
}

template <typename T>
T* checked_memory(void* memory) {
  if (memory == nullptr)
    throw Error("ray tracer: there is not enough memory for a level's geometry");
  return static_cast<T*>(memory);
}

template <typename T>
void copy_to_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                    const std::vector<T>& values) {
  std::ranges::copy(values, checked_memory<T>(rtcSetNewGeometryBuffer(geometry, type, 0, format,
                                                                      sizeof(T), values.size())));
}

void build_fast_part(const LevelScene::Impl& level, LevelPart& part) {
  RTCDevice device = handle(level.device);
  const std::vector<Leaf>& leaves = part.leaves;
  std::vector<unsigned> first_points(leaves.size());
  std::size_t point_count = 0;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const LeafCells cells{level, leaves[n]};
    first_points[n] = static_cast<unsigned>(point_count);
    point_count +=
        static_cast<std::size_t>(cells.columns + 1) * static_cast<std::size_t>(cells.rows + 1);
  }
  if (point_count > std::numeric_limits<unsigned>::max())
    throw Error("ray tracer: a level has {} points, more than Embree supports", point_count);
  const Owned<RTCBuffer> buffer(rtcNewBuffer(
      device, point_count * sizeof(glm::vec3) + 16));  // Embree reads 16 bytes at a time
  auto* points =
      checked_memory<glm::vec3>(buffer == nullptr ? nullptr : rtcGetBufferData(buffer.get()));
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
    write_points({level, leaves[n]}, level, points + first_points[n]);
  });
  Primitives primitives;
  for (std::size_t n = 0; n < leaves.size(); ++n)
    add_leaf({level, leaves[n]}, first_points[n], level.level.has_quads, part, primitives);
  const auto add = [&](RTCGeometryType type, unsigned id, auto kind, RTCFormat format,
                       const auto& list) {
    if (list.empty()) return;
    const Owned<RTCGeometry> geometry(rtcNewGeometry(device, type));
    rtcSetGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, buffer.get(),
                         0, sizeof(glm::vec3), point_count);
    copy_to_buffer(geometry.get(), kind, format, list);
    attach(part.scene.get(), geometry, id);
  };
  add(RTC_GEOMETRY_TYPE_GRID, block_geometry, RTC_BUFFER_TYPE_GRID, RTC_FORMAT_GRID,
      primitives.grids);
  add(RTC_GEOMETRY_TYPE_QUAD, block_geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4,
      primitives.quads);
  add(RTC_GEOMETRY_TYPE_TRIANGLE, facet_geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
      primitives.triangles);
}

// Cells [begin, end) of a leaf that are one primitive of exact tracing. Few cells make tight boxes,
// so that few rays are tested in vain.
struct CellGroup {
  glm::ivec2 begin{0}, end{0};
};

const Leaf& leaf_of(const LevelPart& part, unsigned primitive) {
  return part.leaves[primitive >> (2 * part.groups_exponent)];
}

// Returns the group of a primitive in the given cells of its leaf; empty if it lies beyond the DEM.
CellGroup group_of(const LevelPart& part, const LeafCells& cells, unsigned primitive) {
  const unsigned mask = (1U << part.groups_exponent) - 1;
  const glm::ivec2 place(primitive & mask, (primitive >> part.groups_exponent) & mask);
  const int side = cells.level.leaf_cells * cells.leaf.step;
  const int size = side >> (cells.exponent + part.groups_exponent);
  const glm::ivec2 end(cells.columns, cells.rows);
  return {glm::min(place * size, end), glm::min((place + 1) * size, end)};
}

void group_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& part = *static_cast<const LevelPart*>(arguments->geometryUserPtr);
  const LevelScene::Impl& level = *part.built_for;
  const LeafCells cells{level, leaf_of(part, arguments->primID)};
  const auto [begin, end] = group_of(part, cells, arguments->primID);
  double low_m = std::numeric_limits<double>::infinity();
  double high_m = -low_m;
  for (int j = begin.y; j < end.y; ++j) {
    for (int i = begin.x; i < end.x; ++i) {
      const Cell cell = cells.cell(i, j);
      for (const double corner_m : {cell.nw, cell.ne, cell.sw, cell.se}) {
        low_m = std::min(low_m, corner_m);
        high_m = std::max(high_m, corner_m);
      }
    }
  }
  RTCBounds& bounds = *arguments->bounds_o;
  if (!(low_m <= high_m)) {  // Embree ignores primitives without valid bounds
    bounds.lower_x = std::numeric_limits<float>::infinity();
    bounds.upper_x = -bounds.lower_x;
    return;
  }
  const glm::dvec3 a = level.point_L(cells.column(begin.x), cells.row(begin.y), low_m);
  const glm::dvec3 b = level.point_L(cells.column(end.x), cells.row(end.y), high_m);
  const glm::vec3 low = glm::vec3(glm::min(a, b)) - part.slack_m;
  const glm::vec3 high = glm::vec3(glm::max(a, b)) + part.slack_m;
  bounds.lower_x = low.x;
  bounds.lower_y = low.y;
  bounds.lower_z = low.z;
  bounds.upper_x = high.x;
  bounds.upper_y = high.y;
  bounds.upper_z = high.z;
}

// Reports the first crossing over one group for each ray of a packet, in double.
void intersect_group(const RTCIntersectFunctionNArguments* arguments) {
  const auto& part = *static_cast<const LevelPart*>(arguments->geometryUserPtr);
  const auto& query = *reinterpret_cast<const ExactQuery*>(arguments->context);
  const Leaf& leaf = leaf_of(part, arguments->primID);
  const auto [number, cells] = query.surface->deciding_cells(leaf);
  const auto [begin, end] = group_of(part, cells, arguments->primID);
  const bool is_cell = begin + 1 == end;
  const Cell cell = cells.cell(begin.x, begin.y);
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  RTCHitN* const hits = RTCRayHitN_HitN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned lane = RTCRayN_id(rays, arguments->N, i);
    const LevelRay& ray = query.rays[lane];
    Crossing& best = query.crossings[lane];
    const double before_m = best.range_m;
    if (is_cell) {
      hit_cell(ray.facet, cell, leaf, number, best);
    } else {
      hit_cells(ray.facet, cells, begin, end, number, best);
    }
    if (!(best.range_m < before_m)) continue;
    // tfar only prunes: it may exceed the true range slightly, but is never less.
    float& far_m = RTCRayN_tfar(rays, arguments->N, i);
    far_m = std::min(far_m, far_float(best.range_m - ray.enter_m, part.slack_m));
    RTCHitN_geomID(hits, arguments->N, i) = arguments->geomID;
    RTCHitN_primID(hits, arguments->N, i) = arguments->primID;
  }
}

void build_exact_part(const LevelScene::Impl& level, LevelPart& part) {
  const int most_cells = level.level.has_quads ? 1 : 2;
  const int groups = std::max(level.leaf_cells / most_cells, 1);
  part.groups_exponent = std::countr_zero(static_cast<unsigned>(groups));
  part.built_for = &level;
  const std::size_t count = part.leaves.size() << (2 * part.groups_exponent);
  if (count > std::numeric_limits<unsigned>::max())
    throw Error("ray tracer: a level has {} boxes, more than Embree supports", count);
  attach_primitives(level.device, part.scene.get(), block_geometry, count, &part, group_bounds,
                    intersect_group);
}

}  // namespace

std::shared_ptr<const LevelPart> build_part(const LevelScene::Impl& level, glm::ivec2 place,
                                            std::vector<Leaf> leaves) {
  auto part = std::make_shared<LevelPart>();
  part->place = place;
  part->leaves = std::move(leaves);
  part->slack_m = 2 * level.slack_m;  // so that the level's own slack may grow on reuse
  part->scene = new_scene(level.device);
  if (level.tracing == Tracing::Exact) {
    build_exact_part(level, *part);
  } else {
    build_fast_part(level, *part);
  }
  commit(part->scene.get());
  check(level.device, "building a level");  // here, because Embree reports faults by thread
  part->built_for = nullptr;
  return part;
}

}  // namespace groundray
