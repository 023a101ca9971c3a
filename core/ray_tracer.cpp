// Embree answers in float which surface a ray meets and roughly where; everything that is reported
// is then decided in double on the height grid (docs/surface.md).
#include "core/ray_tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "core/error.h"
#include "core/level_scene.h"
#include "core/ray_packet.h"

namespace groundray {
namespace {

constexpr double walk_cells = 1.5;      // how far round Embree's hit the facet is looked for
constexpr double inside_margin = 1e-9;  // cells; far above rounding, far below any facet

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
