// Embree answers in float which surface a ray meets and roughly where; everything that is reported is then decided in
// double on the height grid (docs/surface.md). The adapter covers Embree 3.13 and Embree 4.
#include "core/ray_tracer.h"

#if GROUNDRAY_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fmt/format.h>
#include <immintrin.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

constexpr unsigned kBlocks = 0;  // geometry ids in every level scene
constexpr unsigned kFacets = 1;
constexpr int kExactCells = 8;         // side of a user primitive in exact tracing
constexpr double kWalkCells = 1.5;     // how far round Embree's hit the facet is looked for
constexpr double kInsideMargin = 1e-9;  // cells; far above rounding, far below any facet
constexpr float kFloatSlack = 0x1p-20f;  // relative: covers float ranges against double ones

#if GROUNDRAY_EMBREE >= 4
using QueryContext = RTCRayQueryContext;
#else
using QueryContext = RTCIntersectContext;
#endif

// A ray as tracing one level needs it: in double, and in float from where it enters the level's box.
struct LevelRay {
  GridRay grid;
  double enter_m = 0;
  double leave_m = 0;
  glm::vec3 origin{0};  // in L
  glm::vec3 direction{0};
  float far = 0;  // metres from the float origin
};

// The double side of a packet, for the callback of exact tracing.
struct Query {
  QueryContext context;
  const LevelRay* rays;
  Crossing* crossings;
};

template <int W>
struct PacketOf;
template <>
struct PacketOf<4> {
  using Type = RTCRayHit4;
};
template <>
struct PacketOf<8> {
  using Type = RTCRayHit8;
};
template <>
struct PacketOf<16> {
  using Type = RTCRayHit16;
};

template <int W, typename RayHit>
void intersect_packet(const int* valid, RTCScene scene, Query& query, RayHit& packet, bool coherent) noexcept {
#if GROUNDRAY_EMBREE >= 4
  rtcInitRayQueryContext(&query.context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &query.context;
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  auto* const how = &arguments;
  if constexpr (W == 1) rtcIntersect1(scene, &packet, how);
  if constexpr (W == 4) rtcIntersect4(valid, scene, &packet, how);
  if constexpr (W == 8) rtcIntersect8(valid, scene, &packet, how);
  if constexpr (W == 16) rtcIntersect16(valid, scene, &packet, how);
#else
  rtcInitIntersectContext(&query.context);
  query.context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  auto* const how = &query.context;
  if constexpr (W == 1) rtcIntersect1(scene, how, &packet);
  if constexpr (W == 4) rtcIntersect4(valid, scene, how, &packet);
  if constexpr (W == 8) rtcIntersect8(valid, scene, how, &packet);
  if constexpr (W == 16) rtcIntersect16(valid, scene, how, &packet);
#endif
  (void)valid;
}

// Embree's traversal wants denormals flushed; the mode of the caller's thread comes back at the end.
class FlushDenormals {
 public:
  FlushDenormals() noexcept : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040); }
  ~FlushDenormals() { _mm_setcsr(before_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned before_;
};

struct LevelScene {
  Level level;
  glm::dvec3 p_DL{0};
  RTCScene scene = nullptr;
  std::vector<glm::ivec2> tiles;  // first cells of the user primitives of exact tracing
  float slack_m = 0;              // 16 * 2^-24 * max|p_L|: covers rounding to floats
};

// Where Embree says a ray hits.
struct FloatHit {
  unsigned geometry = RTC_INVALID_GEOMETRY_ID;
  unsigned primitive = 0;
  float u = 0, v = 0;
  float range_m = 0;  // from the float origin
};

// A bound in float for a range in double, never short of it.
float far_float(double range_m, float slack_m) noexcept {
  return static_cast<float>(range_m) * (1 + kFloatSlack) + slack_m;
}

glm::dvec3 sample_L(const LevelScene& level, int column, int row, double height_m) noexcept {
  const HeightGrid& grid = level.level.grid;
  return glm::dvec3(grid.origin_m() + glm::dvec2(column, row) * grid.step_m(), height_m) - level.p_DL;
}

// Narrows [begin_m, end_m] to where start + t slope lies in [low, high].
void clip(double start, double slope, double low, double high, double& begin_m, double& end_m) noexcept {
  if (slope == 0) {
    if (start < low || high < start) end_m = -std::numeric_limits<double>::infinity();
    return;
  }
  const double inverse = 1 / slope;
  const double a = (low - start) * inverse;
  const double b = (high - start) * inverse;
  begin_m = std::max(begin_m, std::min(a, b));
  end_m = std::min(end_m, std::max(a, b));
}

// Reports the first crossing of one tile's cells for each ray of a packet, in double.
void intersect_tile(const RTCIntersectFunctionNArguments* arguments) {
  const auto& level = *static_cast<const LevelScene*>(arguments->geometryUserPtr);
  const auto& query = *reinterpret_cast<const Query*>(arguments->context);
  const glm::dvec2 low = glm::dvec2(level.tiles[arguments->primID]) - 0.5;
  const glm::dvec2 high = low + glm::dvec2(kExactCells + 1);
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  RTCHitN* const hits = RTCRayHitN_HitN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned lane = RTCRayN_id(rays, arguments->N, i);
    const LevelRay& ray = query.rays[lane];
    Crossing& best = query.crossings[lane];
    double begin_m = ray.enter_m;
    double end_m = std::min(ray.leave_m, best.range_m);
    clip(ray.grid.u0, ray.grid.du, low.x, high.x, begin_m, end_m);
    clip(ray.grid.v0, ray.grid.dv, low.y, high.y, begin_m, end_m);
    if (!(begin_m <= end_m)) continue;
    const auto crossing = level.level.grid.first_crossing(ray.grid, begin_m, end_m);
    if (!crossing || !(crossing->range_m < best.range_m)) continue;
    best = *crossing;
    // The float range only prunes: Embree may go on a little beyond the true one, never stop before it.
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
  const glm::ivec2 last = glm::min(first + kExactCells, glm::ivec2(grid.columns(), grid.rows()) - 1);
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
  const glm::ivec2 count = (glm::ivec2(level.grid.columns(), level.grid.rows()) - 2) / kExactCells + 1;
  std::vector<bool> occupied(static_cast<std::size_t>(count.x) * static_cast<std::size_t>(count.y));
  const auto mark = [&](glm::ivec2 tile) {
    occupied[static_cast<std::size_t>(tile.y) * static_cast<std::size_t>(count.x) +
             static_cast<std::size_t>(tile.x)] = true;
  };
  for (const Level::Block& block : level.blocks) {
    const glm::ivec2 first = glm::ivec2(block.column, block.row) / kExactCells;
    const glm::ivec2 last = glm::ivec2(block.column + block.columns - 2, block.row + block.rows - 2) / kExactCells;
    for (int row = first.y; row <= last.y; ++row) {
      for (int column = first.x; column <= last.x; ++column) mark({column, row});
    }
  }
  for (const Facet& facet : level.facets) mark(glm::ivec2(facet.column, facet.row) / kExactCells);
  std::vector<glm::ivec2> tiles;
  for (int row = 0; row < count.y; ++row) {
    for (int column = 0; column < count.x; ++column) {
      if (occupied[static_cast<std::size_t>(row) * static_cast<std::size_t>(count.x) +
                   static_cast<std::size_t>(column)]) {
        tiles.push_back(glm::ivec2(column, row) * kExactCells);
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
  attach(level.scene, geometry, kBlocks);
}

RTCBuffer new_vertices(RTCDevice device, const LevelScene& level) {
  const HeightGrid& grid = level.level.grid;
  const auto samples = grid.heights_m().size();
  RTCBuffer vertices = rtcNewBuffer(device, samples * sizeof(glm::vec3) + 16);  // Embree reads 16 bytes at a time
  auto* out = static_cast<glm::vec3*>(rtcGetBufferData(vertices));
  if (out == nullptr) return vertices;
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
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices, 0, sizeof(glm::vec3),
                         samples);
    auto* grids = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID,
                                                                sizeof(RTCGrid), level.level.blocks.size()));
    for (const Level::Block& block : level.level.blocks) {
      *grids++ = {static_cast<unsigned>(block.row) * columns + static_cast<unsigned>(block.column), columns,
                  static_cast<unsigned short>(block.columns), static_cast<unsigned short>(block.rows)};
    }
    attach(level.scene, geometry, kBlocks);
  }
  if (!level.level.facets.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices, 0, sizeof(glm::vec3),
                         samples);
    auto* indices = static_cast<glm::uvec3*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3),
                                level.level.facets.size()));
    for (const Facet& facet : level.level.facets) {
      const unsigned first = static_cast<unsigned>(facet.row) * columns + static_cast<unsigned>(facet.column);
      const unsigned apex = facet.half == Facet::Half::Near ? first : first + columns + 1;
      *indices++ = {apex, first + 1, first + columns};
    }
    attach(level.scene, geometry, kFacets);
  }
  rtcReleaseBuffer(vertices);
}

// Whether the ray meets the level's box, and if so its part inside it, in double and in float.
bool enter(const LevelScene& level, const Ray& ray, LevelRay& out) noexcept {
  const HeightGrid& grid = level.level.grid;
  out.grid = grid.to_grid(ray.origin, ray.direction);
  out.enter_m = 0;
  out.leave_m = ray.far_m;
  constexpr double rim = 1e-6;  // cells, so that rays along the border are inside
  clip(out.grid.u0, out.grid.du, -rim, grid.columns() - 1 + rim, out.enter_m, out.leave_m);
  clip(out.grid.v0, out.grid.dv, -rim, grid.rows() - 1 + rim, out.enter_m, out.leave_m);
  clip(out.grid.z0, out.grid.dz, grid.min_height_m() - level.slack_m, grid.max_height_m() + level.slack_m, out.enter_m,
       out.leave_m);
  if (!(out.enter_m <= out.leave_m)) return false;
  out.origin = glm::vec3(ray.origin + ray.direction * out.enter_m - level.p_DL);
  out.direction = glm::vec3(ray.direction);
  out.far = far_float(out.leave_m - out.enter_m, level.slack_m);
  return true;
}

FloatHit intersect_one(const LevelScene& level, const LevelRay& ray, double from_m,
                       const glm::vec3& direction) noexcept {
  RTCRayHit one{};
  one.ray = {ray.origin.x, ray.origin.y, ray.origin.z, static_cast<float>(from_m - ray.enter_m),
             direction.x, direction.y, direction.z, 0, ray.far, ~0u, 0, 0};
  one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  Query query{};
  intersect_packet<1>(nullptr, level.scene, query, one, false);
  return {one.hit.geomID, one.hit.primID, one.hit.u, one.hit.v, one.ray.tfar};
}

Facet facet_of(const LevelScene& level, const FloatHit& hit) noexcept {
  if (hit.geometry == kFacets) return level.level.facets[hit.primitive];
  const Level::Block& block = level.level.blocks[hit.primitive];
  const float u = hit.u * static_cast<float>(block.columns - 1);
  const float v = hit.v * static_cast<float>(block.rows - 1);
  const int column = std::clamp(static_cast<int>(u), 0, block.columns - 2);
  const int row = std::clamp(static_cast<int>(v), 0, block.rows - 2);
  const bool far_half = u - static_cast<float>(column) + (v - static_cast<float>(row)) > 1;
  return {block.column + column, block.row + row, far_half ? Facet::Half::Far : Facet::Half::Near};
}

// Whether the ray, seen from its origin, comes down on `facet` well inside its edges at `range_m`.
bool meets_inside(const GridRay& ray, const Facet& facet, double range_m) noexcept {
  const double u = ray.u0 + range_m * ray.du - facet.column;
  const double v = ray.v0 + range_m * ray.dv - facet.row;
  if (facet.half == Facet::Half::Near) return std::min({u, v, 1 - (u + v)}) > kInsideMargin;
  return std::min({1 - u, 1 - v, u + v - 1}) > kInsideMargin;
}

bool ends_below(const LevelScene& level, const LevelRay& ray) noexcept {
  const double end_z_m = ray.grid.z0 + ray.leave_m * ray.grid.dz;
  if (end_z_m >= level.level.grid.max_height_m()) return false;
  return end_z_m < level.level.grid.min_height_m() || level.level.grid.clearance_m(ray.grid, ray.leave_m) < 0;
}

glm::vec3 one_ulp_off(const glm::vec3& direction) noexcept {
  constexpr float up = std::numeric_limits<float>::infinity();
  return {std::nextafter(direction.x, up), std::nextafter(direction.y, up), std::nextafter(direction.z, up)};
}

bool from_behind(const LevelScene& level, const LevelRay& ray, const FloatHit& hit) noexcept {
  const FacetPlane plane = level.level.grid.plane(facet_of(level, hit));
  return ray.grid.dz > plane.u_slope_m * ray.grid.du + plane.v_slope_m * ray.grid.dv;
}

// Decides a ray that is not settled by the facet that Embree hit: at an edge, from behind, or a miss that ends below.
// The last two may be a leak through a vertex or an edge, which a direction one ulp off rarely shares. If they stay, the
// ray came through a hole, began below ground, or leaked twice: the facets along it are then asked one by one.
std::optional<Crossing> search(const LevelScene& level, const LevelRay& ray, FloatHit hit) noexcept {
  const HeightGrid& grid = level.level.grid;
  const double reach_m = kWalkCells / std::max(std::abs(ray.grid.du), std::abs(ray.grid.dv));
  double from_m = ray.enter_m;
  for (bool retried = false;;) {
    const bool miss = hit.geometry == RTC_INVALID_GEOMETRY_ID;
    if (miss && !ends_below(level, ray)) return std::nullopt;
    if (miss || from_behind(level, ray, hit)) {
      if (retried) return grid.first_crossing(ray.grid, from_m, ray.leave_m);
      retried = true;
      hit = intersect_one(level, ray, from_m, one_ulp_off(ray.direction));
      continue;
    }
    const double at_m = ray.enter_m + hit.range_m;
    const double end_m = std::min(at_m + reach_m, ray.leave_m);
    if (auto crossing = grid.first_crossing(ray.grid, std::max(from_m, at_m - reach_m), end_m)) return crossing;
    if (!(from_m < end_m && end_m < ray.leave_m)) return std::nullopt;
    from_m = end_m;
    hit = intersect_one(level, ray, from_m, ray.direction);
  }
}

std::optional<Crossing> decide(const LevelScene& level, const LevelRay& ray, const FloatHit& hit) noexcept {
  if (hit.geometry != RTC_INVALID_GEOMETRY_ID) {
    const Facet facet = facet_of(level, hit);
    const FacetPlane plane = level.level.grid.plane(facet);
    const double closing = plane.u_slope_m * ray.grid.du + plane.v_slope_m * ray.grid.dv - ray.grid.dz;
    const double range_m = intersect(ray.grid, plane);
    if (closing > 0 && ray.enter_m <= range_m && range_m <= ray.leave_m && meets_inside(ray.grid, facet, range_m)) {
      return Crossing{range_m, facet};
    }
  } else if (!ends_below(level, ray)) {
    return std::nullopt;
  }
  return search(level, ray, hit);
}

template <int W>
struct Packet {
  alignas(64) typename PacketOf<W>::Type floats;
  alignas(64) std::array<int, W> valid;
  std::array<LevelRay, W> rays;
  std::array<Crossing, W> crossings;  // exact tracing fills these

  void put(int lane, const LevelRay& ray) noexcept {
    auto& out = floats.ray;
    out.org_x[lane] = ray.origin.x;
    out.org_y[lane] = ray.origin.y;
    out.org_z[lane] = ray.origin.z;
    out.dir_x[lane] = ray.direction.x;
    out.dir_y[lane] = ray.direction.y;
    out.dir_z[lane] = ray.direction.z;
    out.tnear[lane] = 0;
    out.tfar[lane] = ray.far;
    out.time[lane] = 0;
    out.mask[lane] = ~0u;
    out.id[lane] = static_cast<unsigned>(lane);
    out.flags[lane] = 0;
    floats.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  }
  FloatHit hit(int lane) const noexcept {
    return {floats.hit.geomID[lane], floats.hit.primID[lane], floats.hit.u[lane], floats.hit.v[lane],
            floats.ray.tfar[lane]};
  }
};

template <int W>
void trace_level(const LevelScene& level, std::uint32_t number, Tracing tracing, std::span<const Ray> rays,
                 std::span<Hit> hits, Packet<W>& packet) noexcept {
  const int count = static_cast<int>(rays.size());
  int open = 0;
  for (int lane = 0; lane < W; ++lane) {
    packet.valid[lane] = lane < count && !hits[lane] && enter(level, rays[lane], packet.rays[lane]) ? -1 : 0;
    if (packet.valid[lane] == 0) continue;
    packet.put(lane, packet.rays[lane]);
    packet.crossings[lane] = {};
    ++open;
  }
  if (open == 0) return;
  Query query{{}, packet.rays.data(), packet.crossings.data()};
  intersect_packet<W>(packet.valid.data(), level.scene, query, packet.floats, true);
  for (int lane = 0; lane < count; ++lane) {
    if (packet.valid[lane] == 0) continue;
    std::optional<Crossing> crossing = packet.crossings[lane];
    if (tracing == Tracing::Fast) crossing = decide(level, packet.rays[lane], packet.hit(lane));
    if (!crossing || !(crossing->range_m < std::numeric_limits<double>::infinity())) continue;
    const FacetPlane plane = level.level.grid.plane(crossing->facet);
    hits[lane] = {crossing->range_m, glm::vec3(level.level.grid.normal(plane)), number};
  }
}

}  // namespace

struct RayTracer::Impl {
  RTCDevice device = nullptr;
  Tracing tracing = Tracing::Fast;
  int width = 4;
  std::vector<LevelScene> scenes;
  std::atomic<std::ptrdiff_t> bytes{0};

  ~Impl() {
    for (const LevelScene& scene : scenes) rtcReleaseScene(scene.scene);
    rtcReleaseDevice(device);
  }

  void check(std::string_view doing) const {
    if (rtcGetDeviceError(device) == RTC_ERROR_NONE) return;
    throw Error("ray tracer: Embree failed while {}; is there enough memory?", doing);
  }

  void build(LevelScene& level) {
    const HeightGrid& grid = level.level.grid;
    if (std::isnan(grid.min_height_m())) throw Error("ray tracer: a level has no height at all");
    const glm::dvec3 a = sample_L(level, 0, 0, grid.min_height_m());
    const glm::dvec3 b = sample_L(level, grid.columns() - 1, grid.rows() - 1, grid.max_height_m());
    level.slack_m = static_cast<float>(16 * 0x1p-24 * glm::length(glm::max(glm::abs(a), glm::abs(b))));
    level.scene = rtcNewScene(device);
    rtcSetSceneFlags(level.scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(level.scene, RTC_BUILD_QUALITY_MEDIUM);
    if (tracing == Tracing::Exact) {
      build_exact(device, level);
    } else {
      build_fast(device, level);
    }
    rtcCommitScene(level.scene);
    check("building a level");
  }

  template <int W>
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept {
    Packet<W> packet;
    for (std::size_t begin = 0; begin < rays.size(); begin += W) {
      const std::size_t count = std::min<std::size_t>(W, rays.size() - begin);
      const auto out = hits.subspan(begin, count);
      std::ranges::fill(out, Hit{});
      for (std::size_t i = 0; i < scenes.size(); ++i) {
        trace_level<W>(scenes[i], static_cast<std::uint32_t>(i), tracing, rays.subspan(begin, count), out, packet);
      }
    }
  }
};

RayTracer::RayTracer(std::vector<Level> levels, const glm::dvec3& p_DL, Tracing tracing,
                     const std::string& device_config)
    : impl_(std::make_unique<Impl>()) {
  impl_->tracing = tracing;
  impl_->device = rtcNewDevice(device_config.c_str());
  if (impl_->device == nullptr) throw Error("ray tracer: Embree makes no device for the settings '{}'", device_config);
  rtcSetDeviceMemoryMonitorFunction(
      impl_->device,
      [](void* counter, ssize_t bytes, bool) {
        static_cast<std::atomic<std::ptrdiff_t>*>(counter)->fetch_add(bytes, std::memory_order_relaxed);
        return true;
      },
      &impl_->bytes);
  const auto native = [&](RTCDeviceProperty property) { return rtcGetDeviceProperty(impl_->device, property) != 0; };
  if (native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) {
    impl_->width = 16;
  } else if (native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) {
    impl_->width = 8;
  }
  impl_->scenes.reserve(levels.size());  // Embree keeps pointers to them
  for (Level& level : levels) {
    impl_->scenes.push_back({std::move(level), p_DL, nullptr, {}, 0});
    impl_->build(impl_->scenes.back());
  }
}

RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept {
  const FlushDenormals flush;
  if (impl_->width == 16) return impl_->trace<16>(rays, hits);
  if (impl_->width == 8) return impl_->trace<8>(rays, hits);
  impl_->trace<4>(rays, hits);
}

const HeightGrid& RayTracer::grid(std::uint32_t level) const { return impl_->scenes.at(level).level.grid; }

std::size_t RayTracer::memory_bytes() const { return static_cast<std::size_t>(impl_->bytes.load()); }

std::string RayTracer::description() const {
  const auto version = rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_VERSION);
  return fmt::format("Embree {}.{}.{}, packets of {}", version / 10000, version / 100 % 100, version % 100,
                     impl_->width);
}

glm::dvec3 float_frame_origin(const glm::dvec3& viewpoint) { return glm::round(viewpoint / 2048.0) * 2048.0; }

}  // namespace groundray
