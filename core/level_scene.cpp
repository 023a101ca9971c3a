#include "core/level_scene.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/device.h"
#include "core/error.h"
#include "core/exact_query.h"

namespace groundray {
namespace {

glm::dvec3 point_L(const LevelScene::Impl& level, int column, int row, double height_m) noexcept {
  return glm::dvec3(level.level.frame.to_D({column, row}), height_m) - level.p_DL;
}

// The cells of a leaf: how many, and where their points stand.
struct LeafCells {
  const LevelScene::Impl& level;
  const Leaf& leaf;
  int exponent = std::countr_zero(static_cast<unsigned>(leaf.step));
  int columns = count(leaf.column, level.last.x);
  int rows = count(leaf.row, level.last.y);

  int count(int first, int last) const {
    return std::min(level.level.leaf_cells, (last - first + leaf.step - 1) >> exponent);
  }
  int column(int i) const { return std::min(leaf.column + (i << exponent), level.last.x); }
  int row(int j) const { return std::min(leaf.row + (j << exponent), level.last.y); }
  float height_m(glm::ivec2 point) const { return level.height_m(column(point.x), row(point.y)); }
  bool thins(Leaf::Side side) const { return (leaf.coarser & side) != 0; }
  /// Whether a point is left out for a coarser neighbour.
  bool drops(glm::ivec2 p) const {
    const glm::ivec2 dem_last = level.level.frame.samples - 1;
    return (p.x % 2 == 1 && column(p.x) < dem_last.x &&
            ((p.y == 0 && thins(Leaf::North)) || (p.y == rows && thins(Leaf::South)))) ||
           (p.y % 2 == 1 && row(p.y) < dem_last.y &&
            ((p.x == 0 && thins(Leaf::West)) || (p.x == columns && thins(Leaf::East))));
  }
  /// The cells that are neither narrower nor beside a thinned side: [low, high).
  std::pair<glm::ivec2, glm::ivec2> ordinary() const {
    if (leaf.has_holes) return {glm::ivec2(0), glm::ivec2(0)};
    const bool narrow_x = column(columns) - column(columns - 1) < leaf.step;
    const bool narrow_y = row(rows) - row(rows - 1) < leaf.step;
    return {{thins(Leaf::West) ? 1 : 0, thins(Leaf::North) ? 1 : 0},
            {columns - (thins(Leaf::East) || narrow_x ? 1 : 0),
             rows - (thins(Leaf::South) || narrow_y ? 1 : 0)}};
  }
};

// What Embree is given besides points, gathered leaf by leaf. Each leaf has its own points, so that
// a leaf of any step is one dense grid.
struct Primitives {
  std::vector<RTCGrid> grids;
  std::vector<glm::uvec3> triangles;
};

// A triangle's corners by their place in the leaf; a dropped point gives way to the next one along
// the border.
void add_triangle(const LeafCells& cells, unsigned first_point, glm::ivec2 cell, Half half,
                  bool other_split, LevelScene::Impl& out, Primitives& primitives) {
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
    if (!other_split) return;  // the pair's other cell brings this triangle
    whole = false;
    const glm::ivec2 inward = cell + cell + 1 - corner;  // the cell's corner across
    const bool along_row = corner.x % 2 == 1 && (corner.y == 0 || corner.y == cells.rows);
    corner += along_row ? glm::ivec2(corner.x - inward.x, 0) : glm::ivec2(0, corner.y - inward.y);
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
          point_L(level, cells.column(i), cells.row(j), std::isnan(height_m) ? 0 : height_m));
    }
  }
}

void add_leaf(const LeafCells& cells, unsigned first_point, LevelScene::Impl& out,
              Primitives& primitives) {
  const Leaf& leaf = cells.leaf;
  const auto stride = static_cast<unsigned>(cells.columns + 1);
  const auto [low, high] = cells.ordinary();
  const glm::ivec2 size = glm::max(high - low, 0);
  const bool has_grid = size.x > 0 && size.y > 0;
  if (has_grid) {
    const int exponent = out.deciding_exponent(leaf);
    primitives.grids.push_back(
        {first_point + static_cast<unsigned>(low.y) * stride + static_cast<unsigned>(low.x), stride,
         static_cast<unsigned short>(size.x + 1), static_cast<unsigned short>(size.y + 1)});
    out.grids.push_back({cells.column(low.x), cells.row(low.y), static_cast<std::int8_t>(exponent),
                         size.x << (cells.exponent - exponent),
                         size.y << (cells.exponent - exponent), leaf.deviation_m});
  }
  for (int j = 0; j < cells.rows; ++j) {
    for (int i = 0; i < cells.columns; ++i) {
      if (has_grid && low.x <= i && i < high.x && low.y <= j && j < high.y) {
        i = high.x - 1;  // the grid has these
        continue;
      }
      const Cell cell = out.cell_at(leaf, cells.exponent, cells.column(i), cells.row(j));
      const bool other_split = cell.split != Cell::Split::NorthEastToSouthWest;
      add_triangle(cells, first_point, {i, j}, Half::Near, other_split, out, primitives);
      add_triangle(cells, first_point, {i, j}, Half::Far, other_split, out, primitives);
    }
  }
}

void attach(RTCScene scene, RTCGeometry geometry, unsigned id) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

template <typename T>
T* checked(void* memory) {
  if (memory == nullptr)
    throw Error("ray tracer: there is not enough memory for a level's geometry");
  return static_cast<T*>(memory);
}

template <typename T>
void copy_to_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                    const std::vector<T>& values) {
  std::ranges::copy(values, checked<T>(rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T),
                                                               values.size())));
}

void build_fast(RTCDevice device, LevelScene::Impl& level) {
  const std::vector<Leaf>& leaves = level.level.leaves;
  std::vector<unsigned> first_points(leaves.size());
  std::size_t point_count = 0;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const LeafCells cells{level, leaves[n]};
    first_points[n] = static_cast<unsigned>(point_count);
    point_count +=
        static_cast<std::size_t>(cells.columns + 1) * static_cast<std::size_t>(cells.rows + 1);
  }
  if (point_count > std::numeric_limits<unsigned>::max())
    throw Error("ray tracer: a level has {} points, more than Embree counts", point_count);
  RTCBuffer buffer = rtcNewBuffer(
      device, point_count * sizeof(glm::vec3) + 16);  // Embree reads 16 bytes at a time
  auto* points = checked<glm::vec3>(buffer == nullptr ? nullptr : rtcGetBufferData(buffer));
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
    write_points({level, leaves[n]}, level, points + first_points[n]);
  });
  Primitives primitives;
  for (std::size_t n = 0; n < leaves.size(); ++n)
    add_leaf({level, leaves[n]}, first_points[n], level, primitives);
  const auto add = [&](RTCGeometryType type, unsigned id, auto kind, RTCFormat format,
                       const auto& list) {
    if (list.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, type);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, buffer, 0,
                         sizeof(glm::vec3), point_count);
    copy_to_buffer(geometry, kind, format, list);
    attach(level.scene, geometry, id);
  };
  add(RTC_GEOMETRY_TYPE_GRID, block_geometry, RTC_BUFFER_TYPE_GRID, RTC_FORMAT_GRID,
      primitives.grids);
  add(RTC_GEOMETRY_TYPE_TRIANGLE, facet_geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
      primitives.triangles);
  rtcReleaseBuffer(buffer);
}

void leaf_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& level = *static_cast<const LevelScene::Impl*>(arguments->geometryUserPtr);
  const LeafCells cells{level, level.level.leaves[arguments->primID]};
  float low_m = std::numeric_limits<float>::infinity();
  float high_m = -low_m;
  for (int j = 0; j <= cells.rows; ++j) {
    for (int i = 0; i <= cells.columns; ++i) {
      low_m = std::min(low_m, cells.height_m({i, j}));
      high_m = std::max(high_m, cells.height_m({i, j}));
    }
  }
  const glm::dvec3 a = point_L(level, cells.column(0), cells.row(0), low_m);
  const glm::dvec3 b = point_L(level, cells.column(cells.columns), cells.row(cells.rows), high_m);
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

// Reports the first crossing over one leaf for each ray of a packet, in double.
void intersect_leaf(const RTCIntersectFunctionNArguments* arguments) {
  const auto& level = *static_cast<const LevelScene::Impl*>(arguments->geometryUserPtr);
  const auto& query = *reinterpret_cast<const ExactQuery*>(arguments->context);
  const LeafCells cells{level, level.level.leaves[arguments->primID]};
  constexpr double rim = 0.5;  // cells of the DEM
  const glm::dvec2 low = glm::dvec2(cells.column(0), cells.row(0)) - rim;
  const glm::dvec2 high = glm::dvec2(cells.column(cells.columns), cells.row(cells.rows)) + rim;
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
    const auto crossing = query.surface->first_crossing(ray.grid, begin_m, end_m);
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

void build_exact(RTCDevice device, LevelScene::Impl& level) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(level.level.leaves.size()));
  rtcSetGeometryUserData(geometry, &level);
  rtcSetGeometryBoundsFunction(geometry, leaf_bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect_leaf);
  attach(level.scene, geometry, block_geometry);
}

// A point that is left out joins two triangles.
std::size_t count_triangles(const LeafCells& cells) {
  const bool plain = cells.leaf.coarser == 0 && !cells.leaf.has_holes;
  auto count = 2 * static_cast<std::size_t>(cells.columns) * static_cast<std::size_t>(cells.rows);
  for (int j = 0; j <= cells.rows && !plain; ++j) {
    for (int i = 0; i <= cells.columns; ++i) {
      count -= cells.drops({i, j}) ? 1 : 0;
      if (!cells.leaf.has_holes || i == cells.columns || j == cells.rows) continue;
      const Cell cell =
          cells.level.cell_at(cells.leaf, cells.exponent, cells.column(i), cells.row(j));
      for (const Half half : {Half::Near, Half::Far})
        count -= std::isnan(cell.plane(half).height_m) ? 1 : 0;
    }
  }
  return count;
}

void map_leaves(LevelScene::Impl& level) {
  const Level& in = level.level;
  level.last = glm::min(in.first + (in.heights.size() - 1) * in.step, in.frame.samples - 1);
  level.step_exponent = std::countr_zero(static_cast<unsigned>(in.step));
  level.block_exponent =
      level.step_exponent + std::countr_zero(static_cast<unsigned>(in.leaf_cells));
  const int side = 1 << level.block_exponent;
  level.blocks = (level.last - in.first - 1) / side + 1;
  level.leaf_of_block.assign(
      static_cast<std::size_t>(level.blocks.x) * static_cast<std::size_t>(level.blocks.y), -1);
  for (std::size_t n = 0; n < in.leaves.size(); ++n) {
    const Leaf& leaf = in.leaves[n];
    const glm::ivec2 low = (glm::ivec2(leaf.column, leaf.row) - in.first) / side;
    const glm::ivec2 high = glm::min(low + leaf.step / in.step, level.blocks);
    for (int y = low.y; y < high.y; ++y) {
      for (int x = low.x; x < high.x; ++x) {
        level.leaf_of_block[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.blocks.x) +
                            static_cast<std::size_t>(x)] = static_cast<std::int32_t>(n);
      }
    }
    level.deviation_m = std::max(level.deviation_m, leaf.deviation_m);
    level.bridging_leaves += leaf.has_holes && leaf.step > 1 ? 1 : 0;
    level.triangle_count += count_triangles({level, leaf});
  }
}

}  // namespace

MaxHeights::MaxHeights(const HeightArray& heights) : tiles_((heights.size() - 2) / tile_cells + 1) {
  heights_m_.reserve(static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y));
  const glm::ivec2 last = heights.size() - 1;
  for (int top = 0; top < last.y; top += tile_cells) {
    for (int left = 0; left < last.x; left += tile_cells) {
      float high_m = -std::numeric_limits<float>::infinity();
      for (int row = top; row <= std::min(top + tile_cells, last.y); ++row) {
        for (int column = left; column <= std::min(left + tile_cells, last.x); ++column)
          high_m = std::max(high_m, heights(column, row));
      }
      heights_m_.push_back(high_m);
    }
  }
}

LevelScene::Impl::Impl(const RayDevice& with, Level content, const glm::dvec3& origin, Tracing how)
    : device(with), level(std::move(content)), p_DL(origin), tracing(how) {
  map_leaves(*this);
  max_heights = MaxHeights(level.heights);
  const bool empty = std::isnan(level.heights.min_m());
  const glm::dvec3 a =
      point_L(*this, level.first.x, level.first.y, empty ? 0 : level.heights.min_m());
  const glm::dvec3 b = point_L(*this, last.x, last.y, empty ? 0 : level.heights.max_m());
  slack_m = static_cast<float>(16 * 0x1p-24 * glm::length(glm::max(glm::abs(a), glm::abs(b))));
  scene = new_scene(device);
  if (tracing == Tracing::Exact) {
    build_exact(handle(device), *this);
  } else {
    build_fast(handle(device), *this);
  }
  rtcCommitScene(scene);
  check(device, "building a level");
}

LevelScene::Impl::~Impl() { rtcReleaseScene(scene); }

LevelScene::LevelScene(const RayDevice& device, Level level, const glm::dvec3& p_DL,
                       Tracing tracing)
    : impl_(std::make_shared<const Impl>(device, std::move(level), p_DL, tracing)) {}

const Level& LevelScene::level() const noexcept { return impl_->level; }
const glm::dvec3& LevelScene::p_DL() const noexcept { return impl_->p_DL; }
Tracing LevelScene::tracing() const noexcept { return impl_->tracing; }
float LevelScene::deviation_m() const noexcept { return impl_->deviation_m; }
std::size_t LevelScene::triangle_count() const noexcept { return impl_->triangle_count; }
std::size_t LevelScene::bridging_leaves() const noexcept { return impl_->bridging_leaves; }

}  // namespace groundray
