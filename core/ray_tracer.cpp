// Embree answers in float which surface a ray meets and roughly where; everything that is reported
// is then decided in double on the height grid (docs/surface.md).
#include "core/ray_tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "core/error.h"
#include "core/level_scene.h"

namespace groundray {
namespace {

constexpr double walk_cells = 1.5;      // how far round Embree's hit the facet is looked for
constexpr double inside_margin = 1e-9;  // cells; far above rounding, far below any facet

// Where Embree says a ray hits.
struct FloatHit {
  unsigned geometry = RTC_INVALID_GEOMETRY_ID;
  unsigned primitive = 0;
  float u = 0, v = 0;
  float range_m = 0;  // from the float origin
};

FloatHit intersect_one(const LevelScene& level, const LevelRay& ray, double from_m,
                       const glm::vec3& direction) noexcept {
  RTCRayHit one{};
  one.ray = {ray.origin.x,
             ray.origin.y,
             ray.origin.z,
             static_cast<float>(from_m - ray.enter_m),
             direction.x,
             direction.y,
             direction.z,
             0,
             ray.far_m,
             ~0u,
             0,
             0};
  one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  QueryContext context;
  intersect<1>(level.scene, nullptr, one, context, Coherence::Incoherent);
  return {one.hit.geomID, one.hit.primID, one.hit.u, one.hit.v, one.ray.tfar};
}

inline Facet facet_of(const LevelScene& level, const FloatHit& hit) noexcept {
  if (hit.geometry == facet_geometry) return level.level.facets[hit.primitive];
  const Level::Block& block = level.level.blocks[hit.primitive];
  const float u = hit.u * static_cast<float>(block.columns - 1);
  const float v = hit.v * static_cast<float>(block.rows - 1);
  const int column = std::clamp(static_cast<int>(u), 0, block.columns - 2);
  const int row = std::clamp(static_cast<int>(v), 0, block.rows - 2);
  const bool far_half = u - static_cast<float>(column) + (v - static_cast<float>(row)) > 1;
  return {block.column + column, block.row + row, far_half ? Facet::Half::Far : Facet::Half::Near};
}

// Whether the ray is below the surface where it leaves the level's box; most are far above, which
// one look tells.
bool ends_below(const LevelScene& level, const GridRay& ray, double leave_m) noexcept {
  const double z_m = ray.z0 + leave_m * ray.dz;
  const bool high =
      z_m >= level.max_heights.at(ray.u0 + leave_m * ray.du, ray.v0 + leave_m * ray.dv);
  return !high &&
         (z_m < level.level.grid.min_height_m() || level.level.grid.clearance_m(ray, leave_m) < 0);
}

glm::vec3 one_ulp_off(const glm::vec3& direction) noexcept {
  constexpr float up = std::numeric_limits<float>::infinity();
  return {std::nextafter(direction.x, up), std::nextafter(direction.y, up),
          std::nextafter(direction.z, up)};
}

bool from_behind(const LevelScene& level, const LevelRay& ray, const FloatHit& hit) noexcept {
  const FacetPlane plane = level.level.grid.plane(facet_of(level, hit));
  return ray.grid.dz > plane.u_slope_m * ray.grid.du + plane.v_slope_m * ray.grid.dv;
}

// Decides a ray that is not settled by the facet that Embree hit: at an edge, from behind, or a
// miss that ends below. The last two may be a leak through a vertex or an edge, which a direction
// one ulp off rarely shares. If they stay, the ray came through a hole, began below ground, or
// leaked twice: the facets along it are then asked one by one.
std::optional<Crossing> search(const LevelScene& level, const LevelRay& ray,
                               FloatHit hit) noexcept {
  const HeightGrid& grid = level.level.grid;
  const double reach_m = walk_cells / std::max(std::abs(ray.grid.du), std::abs(ray.grid.dv));
  double from_m = ray.enter_m;
  for (bool retried = false;;) {
    const bool miss = hit.geometry == RTC_INVALID_GEOMETRY_ID;
    if (miss && !ends_below(level, ray.grid, ray.leave_m)) return std::nullopt;
    if (miss || from_behind(level, ray, hit)) {
      if (retried) return grid.first_crossing(ray.grid, from_m, ray.leave_m);
      retried = true;
      hit = intersect_one(level, ray, from_m, one_ulp_off(ray.direction));
      continue;
    }
    const double at_m = ray.enter_m + hit.range_m;
    const double end_m = std::min(at_m + reach_m, ray.leave_m);
    if (auto crossing = grid.first_crossing(ray.grid, std::max(from_m, at_m - reach_m), end_m))
      return crossing;
    if (!(from_m < end_m && end_m < ray.leave_m)) return std::nullopt;
    from_m = end_m;
    hit = intersect_one(level, ray, from_m, ray.direction);
  }
}

// A packet of rays on their way through one level, each number in an array over the lanes so that
// the loops below become vector instructions. Lanes beyond the last ray repeat it and are not
// valid.
template <int W>
struct Packet {
  using Doubles = std::array<double, W>;

  alignas(64) typename PacketOf<W>::Type floats;
  alignas(64) std::array<int, W> valid;
  alignas(64) Doubles u0, v0, z0, du, dv, dz;  // as GridRay
  Doubles enter_m, leave_m;
  Doubles column, row, side;  // facet of the hit; side is 1 for the near half, -1 for the far one
  Doubles apex_m, east_m, south_m;         // heights of its samples
  Doubles height_m, u_slope_m, v_slope_m;  // its plane
  Doubles range_m, inside;
  std::array<LevelRay, W> exact_rays;  // exact tracing only
  std::array<Crossing, W> crossings;

  GridRay grid_ray(int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {u0[i], v0[i], z0[i], du[i], dv[i], dz[i]};
  }
  LevelRay level_ray(int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {grid_ray(lane),
            enter_m[i],
            leave_m[i],
            {floats.ray.org_x[i], floats.ray.org_y[i], floats.ray.org_z[i]},
            {floats.ray.dir_x[i], floats.ray.dir_y[i], floats.ray.dir_z[i]},
            far_float(leave_m[i] - enter_m[i], 0)};
  }
  FloatHit hit(int lane) const noexcept {
    return {floats.hit.geomID[lane], floats.hit.primID[lane], floats.hit.u[lane],
            floats.hit.v[lane], floats.ray.tfar[lane]};
  }
  void take(int lane, const HeightGrid& grid, const Facet& facet) noexcept {
    const auto i = static_cast<std::size_t>(lane);
    const int apex = facet.half == Facet::Half::Near ? 0 : 1;
    column[i] = facet.column;
    row[i] = facet.row;
    side[i] = 1 - 2 * apex;
    apex_m[i] = grid.height_m(facet.column + apex, facet.row + apex);
    east_m[i] = grid.height_m(facet.column + 1, facet.row);
    south_m[i] = grid.height_m(facet.column, facet.row + 1);
  }
  // As HeightGrid::plane, operation by operation: ranges must not depend on who computes them.
  void find_planes() noexcept {
    for (std::size_t i = 0; i < W; ++i) {
      const bool near_half = side[i] > 0;
      const double u_m = near_half ? east_m[i] - apex_m[i] : apex_m[i] - south_m[i];
      const double v_m = near_half ? south_m[i] - apex_m[i] : apex_m[i] - east_m[i];
      const double corner_m = near_half ? apex_m[i] : east_m[i] + south_m[i] - apex_m[i];
      u_slope_m[i] = u_m;
      v_slope_m[i] = v_m;
      height_m[i] = corner_m - (u_m * column[i] + v_m * row[i]);
    }
  }
};

// Brings the rays into the level's grid and into L, cut to the part inside the level's box. Returns
// whether any has one.
template <int W>
bool enter(const LevelScene& level, std::span<const Ray> rays, std::span<const Hit> hits,
           Packet<W>& packet) noexcept {
  const HeightGrid& grid = level.level.grid;
  constexpr double rim = 1e-6;  // cells, so that rays along the border are inside
  const glm::dvec3 low(-rim, -rim, grid.min_height_m() - level.slack_m);
  const glm::dvec3 high(grid.columns() - 1 + rim, grid.rows() - 1 + rim,
                        grid.max_height_m() + level.slack_m);
  auto& out = packet.floats.ray;
  std::array<std::array<double, W>, 6> in;
  for (std::size_t i = 0; i < W; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    in[0][i] = ray.origin.x;
    in[1][i] = ray.origin.y;
    in[2][i] = ray.origin.z;
    in[3][i] = ray.direction.x;
    in[4][i] = ray.direction.y;
    in[5][i] = ray.direction.z;
    packet.leave_m[i] = ray.far_m;
  }
  const glm::dvec2 origin_m = grid.origin_m();
  const glm::dvec2 per_m = grid.cells_per_m();
  for (std::size_t i = 0; i < W; ++i) {
    packet.u0[i] = (in[0][i] - origin_m.x) * per_m.x;
    packet.v0[i] = (in[1][i] - origin_m.y) * per_m.y;
    packet.z0[i] = in[2][i];
    packet.du[i] = in[3][i] * per_m.x;
    packet.dv[i] = in[4][i] * per_m.y;
    packet.dz[i] = in[5][i];
  }
  for (std::size_t i = 0; i < W; ++i) {
    const double iu = 1 / packet.du[i], iv = 1 / packet.dv[i], iz = 1 / packet.dz[i];
    const double ua = (low.x - packet.u0[i]) * iu, ub = (high.x - packet.u0[i]) * iu;
    const double va = (low.y - packet.v0[i]) * iv, vb = (high.y - packet.v0[i]) * iv;
    const double za = (low.z - packet.z0[i]) * iz, zb = (high.z - packet.z0[i]) * iz;
    const double begin_m =
        std::max(std::max(std::min(ua, ub), std::min(va, vb)), std::max(std::min(za, zb), 0.0));
    packet.leave_m[i] = std::min(std::min(std::max(ua, ub), std::max(va, vb)),
                                 std::min(std::max(za, zb), packet.leave_m[i]));
    packet.enter_m[i] = begin_m;
    out.org_x[i] = static_cast<float>(in[0][i] + in[3][i] * begin_m - level.p_DL.x);
    out.org_y[i] = static_cast<float>(in[1][i] + in[4][i] * begin_m - level.p_DL.y);
    out.org_z[i] = static_cast<float>(in[2][i] + in[5][i] * begin_m - level.p_DL.z);
    out.dir_x[i] = static_cast<float>(in[3][i]);
    out.dir_y[i] = static_cast<float>(in[4][i]);
    out.dir_z[i] = static_cast<float>(in[5][i]);
    out.tnear[i] = 0;
    out.tfar[i] = far_float(packet.leave_m[i] - begin_m, level.slack_m);
    out.time[i] = 0;
    out.mask[i] = ~0u;
    out.id[i] = static_cast<unsigned>(i);
    out.flags[i] = 0;
    packet.floats.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    const bool open = i < rays.size() && !hits[i] && packet.enter_m[i] <= packet.leave_m[i];
    packet.valid[i] = open ? -1 : 0;
    any |= open;
  }
  return any;
}

// Meets each ray with the plane of the facet that Embree hit, and finds how far inside the facet
// that is (cells); negative if it is not, or if the plane is met from behind.
template <int W>
void meet_planes(Packet<W>& packet) noexcept {
  for (std::size_t i = 0; i < W; ++i) {
    const double above_m = packet.z0[i] - (packet.height_m[i] + packet.u_slope_m[i] * packet.u0[i] +
                                           packet.v_slope_m[i] * packet.v0[i]);
    const double closing =
        -(packet.dz[i] - (packet.u_slope_m[i] * packet.du[i] + packet.v_slope_m[i] * packet.dv[i]));
    const double range_m = above_m / closing;
    const double side = packet.side[i];
    const double offset =
        (1 - side) / 2;  // the far half is the near half turned round: 1 - u, 1 - v
    const double u = packet.u0[i] + range_m * packet.du[i] - packet.column[i];
    const double v = packet.v0[i] + range_m * packet.dv[i] - packet.row[i];
    const double inside =
        std::min(std::min(offset + side * u, offset + side * v), side * (1 - (u + v)));
    const double along_m = std::min(range_m - packet.enter_m[i], packet.leave_m[i] - range_m);
    packet.range_m[i] = range_m;
    packet.inside[i] = std::min(along_m, closing) > 0 ? inside : -1.0;
  }
}

template <int W>
void decide_fast(const LevelScene& level, Packet<W>& packet) noexcept {
  const HeightGrid& grid = level.level.grid;
  bool any_hit = false;
  for (int lane = 0; lane < W; ++lane) {
    const FloatHit hit = packet.hit(lane);
    const bool met = packet.valid[static_cast<std::size_t>(lane)] != 0 &&
                     hit.geometry != RTC_INVALID_GEOMETRY_ID;
    packet.take(lane, grid, met ? facet_of(level, hit) : Facet{});
    any_hit |= met;
  }
  if (any_hit) {
    packet.find_planes();
    meet_planes(packet);
  }
  for (int lane = 0; lane < W; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    if (packet.valid[i] == 0) continue;
    const FloatHit hit = packet.hit(lane);
    const bool met = hit.geometry != RTC_INVALID_GEOMETRY_ID;
    if (met && packet.inside[i] > inside_margin) continue;
    const bool open = met || ends_below(level, packet.grid_ray(lane), packet.leave_m[i]);
    const auto crossing = open ? search(level, packet.level_ray(lane), hit) : std::nullopt;
    packet.range_m[i] = crossing ? crossing->range_m : std::numeric_limits<double>::infinity();
    if (crossing) packet.take(lane, grid, crossing->facet);
  }
}

template <int W>
void decide_exact(const LevelScene& level, Packet<W>& packet) noexcept {
  for (int lane = 0; lane < W; ++lane) {
    const Crossing& crossing = packet.crossings[static_cast<std::size_t>(lane)];
    packet.range_m[static_cast<std::size_t>(lane)] = crossing.range_m;
    packet.take(lane, level.level.grid, crossing.facet);
  }
}

template <int W>
void report(const LevelScene& level, std::uint32_t number, Packet<W>& packet,
            std::span<Hit> hits) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    packet.range_m[i] =
        packet.valid[i] != 0 ? packet.range_m[i] : std::numeric_limits<double>::infinity();
    any |= packet.range_m[i] < std::numeric_limits<double>::infinity();
  }
  if (!any) return;
  packet.find_planes();  // again: a search may have changed a facet
  const glm::dvec2 per_m = level.level.grid.cells_per_m();
  std::array<std::array<float, W>, 3> normals;
  for (std::size_t i = 0; i < W; ++i) {
    const double x = -packet.u_slope_m[i] * per_m.x;
    const double y = -packet.v_slope_m[i] * per_m.y;
    const double scale = 1 / std::sqrt(x * x + y * y + 1);
    normals[0][i] = static_cast<float>(x * scale);
    normals[1][i] = static_cast<float>(y * scale);
    normals[2][i] = static_cast<float>(scale);
  }
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!(packet.range_m[i] < std::numeric_limits<double>::infinity())) continue;
    hits[i] = {packet.range_m[i], {normals[0][i], normals[1][i], normals[2][i]}, number};
  }
}

template <int W>
void trace_level(const LevelScene& level, std::uint32_t number, Tracing tracing,
                 std::span<const Ray> rays, std::span<Hit> hits, Packet<W>& packet) noexcept {
  if (!enter(level, rays, hits, packet)) return;
  if (tracing == Tracing::Exact) {
    for (int lane = 0; lane < W; ++lane)
      packet.exact_rays[static_cast<std::size_t>(lane)] = packet.level_ray(lane);
    packet.crossings.fill({});
  }
  ExactQuery query{{}, packet.exact_rays.data(), packet.crossings.data()};
  intersect<W>(level.scene, packet.valid.data(), packet.floats, query.context, Coherence::Coherent);
  if (tracing == Tracing::Exact) {
    decide_exact(level, packet);
  } else {
    decide_fast(level, packet);
  }
  report(level, number, packet, hits);
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

  template <int W>
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept {
    Packet<W> packet;
    for (std::size_t begin = 0; begin < rays.size(); begin += W) {
      const std::size_t count = std::min<std::size_t>(W, rays.size() - begin);
      const auto out = hits.subspan(begin, count);
      std::ranges::fill(out, Hit{});
      for (std::size_t i = 0; i < scenes.size(); ++i) {
        trace_level<W>(scenes[i], static_cast<std::uint32_t>(i), tracing,
                       rays.subspan(begin, count), out, packet);
      }
    }
  }
};

RayTracer::RayTracer(std::vector<Level> levels, const glm::dvec3& p_DL, Tracing tracing,
                     const std::string& device_config)
    : impl_(std::make_unique<Impl>()) {
  impl_->tracing = tracing;
  impl_->device = rtcNewDevice(device_config.c_str());
  if (impl_->device == nullptr)
    throw Error("ray tracer: Embree makes no device for the settings '{}'", device_config);
  rtcSetDeviceMemoryMonitorFunction(
      impl_->device,
      [](void* counter, ssize_t bytes, bool) {
        static_cast<std::atomic<std::ptrdiff_t>*>(counter)->fetch_add(bytes,
                                                                      std::memory_order_relaxed);
        return true;
      },
      &impl_->bytes);
  const auto native = [&](RTCDeviceProperty property) {
    return rtcGetDeviceProperty(impl_->device, property) != 0;
  };
  if (native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) {
    impl_->width = 16;
  } else if (native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) {
    impl_->width = 8;
  }
  impl_->scenes.reserve(levels.size());  // Embree keeps pointers to them
  for (Level& level : levels) {
    impl_->scenes.push_back({.level = std::move(level), .p_DL = p_DL});
    build_level_scene(impl_->device, tracing, impl_->scenes.back());
    impl_->check("building a level");
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

const HeightGrid& RayTracer::grid(std::uint32_t level) const {
  return impl_->scenes.at(level).level.grid;
}

std::size_t RayTracer::memory_bytes() const {
  return static_cast<std::size_t>(impl_->bytes.load());
}

std::string RayTracer::description() const {
  const auto version = rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_VERSION);
  return fmt::format("Embree {}.{}.{}, packets of {}", version / 10000, version / 100 % 100,
                     version % 100, impl_->width);
}

glm::dvec3 float_frame_origin(const glm::dvec3& viewpoint) {
  return glm::round(viewpoint / 2048.0) * 2048.0;
}

}  // namespace groundray
