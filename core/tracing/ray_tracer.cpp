// Embree determines in float which facet a ray hits and approximately where; all reported values
// are then computed in double from the samples (docs/theory/surface.md).
#include "core/tracing/ray_tracer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <mutex>
#include <utility>

#include "core/tracing/device.h"
#include "core/tracing/ray_packet.h"

namespace groundray {
namespace {

constexpr double walk_cells = 1.5;  // distance from Embree's hit within which the facet is searched
constexpr double along_cells = 1e-3;    // distance from a line within which a ray runs along it
constexpr double inside_margin = 1e-9;  // cells; far above rounding, far below any facet

}  // namespace

struct RayTracer::Impl {
  RayDevice device;
  std::vector<LevelScene> scenes;
  LevelSurface surface;
  std::vector<Target> targets;
  // All levels in one scene, for rays that do not traverse them in order; built when the first such
  // ray is traced, which is why tracing may throw. One element for each instance.
  struct PartPlace {
    std::uint32_t level = 0;
    const LevelPart* part = nullptr;
  };
  mutable std::once_flag asked_for_all;
  mutable Owned<RTCScene> all;
  mutable Target everything;
  std::vector<PartPlace> places;

  Impl(const RayDevice& device, std::vector<LevelScene> levels);
  const LevelScene::Impl& level(std::size_t number) const noexcept { return scenes[number].impl(); }
  // Returns the level and the part of a hit.
  PartPlace place_of(const Target& target, const FloatHit& hit) const noexcept {
    if (target.is_all) return places[hit.instance];
    const auto& parts = target.level->parts;
    return {target.number, parts[parts.size() == 1 ? 0 : hit.instance].get()};
  }

  const Target& join_levels() const;

  bool ends_below(const Target& target, const GridRay& ray, double leave_m) const noexcept;
  bool from_behind(const Target& target, const LevelRay& ray, const FloatHit& hit) const noexcept;
  std::optional<Crossing> search(const Target& target, const LevelRay& ray,
                                 FloatHit hit) const noexcept;
  template <int W>
  bool runs_between_parts(const Target& target, const Packet<W>& packet,
                          std::size_t i) const noexcept;
  template <int W>
  void decide_fast(const Target& target, Packet<W>& packet) const noexcept;
  template <int W>
  void trace_target(const Target& target, Coherence coherence, std::span<Hit> hits,
                    Packet<W>& packet) const noexcept;
  template <int W>
  bool start_inside(const Packet<W>& packet) const noexcept;
  template <int W>
  void escape_surface(std::span<Hit> hits, Packet<W>& packet) const noexcept;
  template <int W>
  void trace_packet(Coherence coherence, Packet<W>& packet, std::span<Hit> hits) const;
  template <int W>
  void trace(std::span<const Ray> rays, std::span<Hit> hits, Batch batch,
             std::span<GroundFacet> facets) const;
};

namespace {

Hit hit_of(const GridFrame& frame, const Crossing& crossing) noexcept {
  return {crossing.range_m, glm::vec3(frame.normal(crossing.plane)), crossing.deviation_m,
          crossing.facet.level};
}

Target target_of(const LevelScene& scene, std::uint32_t number) {
  const LevelScene::Impl& level = scene.impl();
  return {.scene = level.scene.get(),
          .level = &level,
          .number = number,
          .min_m = level.level.heights.min_m(),
          .max_m = level.level.heights.max_m(),
          .slack_m = level.slack_m};
}

LevelSurface surface_of(const std::vector<LevelScene>& scenes) {
  std::vector<const LevelScene::Impl*> levels;
  for (const LevelScene& scene : scenes) levels.push_back(&scene.impl());
  return LevelSurface(std::move(levels));
}

}  // namespace

RayTracer::Impl::Impl(const RayDevice& with, std::vector<LevelScene> levels)
    : device(with), scenes(std::move(levels)), surface(surface_of(scenes)) {
  for (std::uint32_t i = 0; i < scenes.size(); ++i) targets.push_back(target_of(scenes[i], i));
  everything = targets.back();
  everything.is_all = true;
  for (std::uint32_t i = 0; i < scenes.size(); ++i) {
    for (const auto& part : level(i).parts) places.push_back({i, part.get()});
    everything.min_m = std::fmin(everything.min_m, targets[i].min_m);
    everything.max_m = std::fmax(everything.max_m, targets[i].max_m);
    everything.slack_m = std::max(everything.slack_m, targets[i].slack_m);
  }
}

const Target& RayTracer::Impl::join_levels() const {
  std::call_once(asked_for_all, [this] {
    std::vector<RTCScene> parts;
    for (const PartPlace& place : places) parts.push_back(place.part->scene.get());
    all = instance_all(device, parts);
    check(device, "joining the levels");
    everything.scene = all.get();
  });
  return everything;
}

// Returns whether the ray is below the surface where it leaves the target's box. Most rays leave
// through its top or are far above the surface, which a single lookup shows.
bool RayTracer::Impl::ends_below(const Target& target, const GridRay& ray,
                                 double leave_m) const noexcept {
  const double z_m = ray.z0 + leave_m * ray.dz;
  if (z_m >= target.max_m) return false;
  if (!target.is_all) {
    const Level& level = target.level->level;
    const double column = (ray.u0 + leave_m * ray.du - level.first.x) / level.step;
    const double row = (ray.v0 + leave_m * ray.dv - level.first.y) / level.step;
    if (z_m >= target.level->max_heights.at(column, row)) return false;
  }
  return z_m < target.min_m || surface.clearance_m(ray, leave_m) < 0;
}

bool RayTracer::Impl::from_behind(const Target& target, const LevelRay& ray,
                                  const FloatHit& hit) const noexcept {
  const PartPlace place = place_of(target, hit);
  const Facet facet = facet_of(*place.part, hit);
  const LevelScene::Impl& on = level(place.level);
  const Leaf* leaf = on.leaf_at(facet.column, facet.row);
  if (leaf == nullptr) return false;
  const LeafCells cells{on, *leaf, facet.step_exponent};
  const FacetPlane plane = cells.cell_at(facet.column, facet.row).plane(facet.half);
  const GridRay& grid = ray.facet.grid;
  return grid.dz > plane.u_slope_m * grid.du + plane.v_slope_m * grid.dv;
}

// Decides a ray that the facet reported by Embree does not settle: a hit at an edge, a hit from
// behind, or a miss that ends below the surface. The last two may be leaks through a vertex or an
// edge, which a direction one ulp off rarely repeats. If the result does not change, the ray passed
// through a hole, began below ground, or leaked twice: the facets along it are then tested one by
// one.
std::optional<Crossing> RayTracer::Impl::search(const Target& target, const LevelRay& ray,
                                                FloatHit hit) const noexcept {
  const GridRay& grid = ray.facet.grid;
  const double cells_per_m = std::max(std::abs(grid.du), std::abs(grid.dv));
  double from_m = ray.enter_m;
  for (bool retried = false;;) {
    const bool miss = hit.geometry == RTC_INVALID_GEOMETRY_ID;
    if (miss && !ends_below(target, grid, ray.leave_m)) return std::nullopt;
    if (miss || from_behind(target, ray, hit)) {
      if (retried) return surface.first_crossing(ray.facet, from_m, ray.leave_m);
      retried = true;
      hit = intersect_one(target, ray, from_m, one_ulp_off(ray.direction));
      continue;
    }
    const int step = 1 << facet_of(*place_of(target, hit).part, hit).step_exponent;
    const double reach_m = walk_cells * step / cells_per_m;
    const double at_m = ray.enter_m + hit.range_m;
    const double end_m = std::min(at_m + reach_m, ray.leave_m);
    if (auto crossing = surface.first_crossing(ray.facet, std::max(from_m, at_m - reach_m), end_m))
      return crossing;
    if (!(from_m < end_m && end_m < ray.leave_m)) return std::nullopt;
    from_m = end_m;
    hit = intersect_one(target, ray, from_m, ray.direction);
  }
}

// Returns whether a ray runs along a line where parts may meet. Embree may miss both parts there:
// its packets and its single rays round the distances to the sides of boxes differently.
template <int W>
bool RayTracer::Impl::runs_between_parts(const Target& target, const Packet<W>& packet,
                                         std::size_t i) const noexcept {
  if (places.size() == 1 || (!target.is_all && target.level->parts.size() == 1)) return false;
  const Level& finest = level(0).level;
  const double block = finest.leaf_cells * finest.step;
  const double length_m = packet.leave_m[i] - packet.enter_m[i];
  const auto runs_along = [&](double start, double slope) {
    return std::abs(slope) * length_m < along_cells &&
           std::abs(std::remainder(start + packet.enter_m[i] * slope, block)) < 2 * along_cells;
  };
  return runs_along(packet.u0[i], packet.du[i]) || runs_along(packet.v0[i], packet.dv[i]);
}

template <int W>
void RayTracer::Impl::decide_fast(const Target& target, Packet<W>& packet) const noexcept {
  std::array<bool, W> whole{};
  bool any_whole = false;
  for (int lane = 0; lane < W; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    const FloatHit hit = packet.hit(lane);
    if (packet.valid[i] != 0 && hit.geometry != RTC_INVALID_GEOMETRY_ID) {
      const PartPlace place = place_of(target, hit);
      packet.level[i] = place.level;
      if (is_whole(*place.part, hit)) {
        whole[i] = any_whole = true;
        packet.take(lane, level(place.level), facet_of(*place.part, hit));
      }
    }
    packet.inside[i] = -1;
  }
  if (any_whole) {
    packet.find_planes();
    meet_planes(packet);
  }
  for (int lane = 0; lane < W; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    if (packet.valid[i] == 0) continue;
    if (runs_between_parts(target, packet, i)) {
      const FacetRay ray = packet.facet_ray(lane, surface.extent());
      packet.take(
          lane,
          surface.first_crossing(ray, packet.enter_m[i], packet.leave_m[i]).value_or(Crossing{}));
      continue;
    }
    if (whole[i] && packet.inside[i] > inside_margin) continue;
    const FloatHit hit = packet.hit(lane);
    const bool open = hit.geometry != RTC_INVALID_GEOMETRY_ID ||
                      ends_below(target, packet.grid_ray(lane), packet.leave_m[i]);
    packet.take(
        lane,
        open ? search(target, packet.level_ray(lane, surface.extent()), hit).value_or(Crossing{})
             : Crossing{});
  }
}

template <int W>
void RayTracer::Impl::trace_target(const Target& target, Coherence coherence, std::span<Hit> hits,
                                   Packet<W>& packet) const noexcept {
  if (std::isnan(target.min_m)) return;  // the level has no heights
  if (!enter(target, hits, packet)) return;
  const bool exact = target.level->tracing == Tracing::Exact;
  if (exact) {
    for (int lane = 0; lane < W; ++lane)
      packet.exact_rays[static_cast<std::size_t>(lane)] = packet.level_ray(lane, surface.extent());
    packet.crossings.fill({});
  }
  ExactQuery query{{}, &surface, packet.exact_rays.data(), packet.crossings.data()};
  intersect<W>(target.scene, packet.valid.data(), packet.floats, query.context, coherence);
  if (exact) {
    for (int lane = 0; lane < W; ++lane) {
      const auto i = static_cast<std::size_t>(lane);
      packet.take(lane, packet.crossings[i]);
      if (packet.valid[i] != 0) packet.facets[i] = packet.crossings[i].facet;
    }
  } else {
    decide_fast(target, packet);
  }
  report(target.level->level.frame, packet, hits);
}

// Returns whether all rays start over the finest window, so that they traverse the levels in order.
template <int W>
bool RayTracer::Impl::start_inside(const Packet<W>& packet) const noexcept {
  if (scenes.size() == 1) return true;
  const glm::ivec2 low = level(0).level.first;
  const glm::ivec2 high = level(0).last;
  bool inside = true;
  for (std::size_t i = 0; i < W; ++i) {
    inside &= low.x <= packet.u0[i] && packet.u0[i] <= high.x && low.y <= packet.v0[i] &&
              packet.v0[i] <= high.y;
  }
  return inside;
}

// Advances the start of rays that begin on the surface until it is so high above it that rounding
// to float cannot place it below. Most rays rise that far over the facet that they leave.
template <int W>
void RayTracer::Impl::escape_surface(std::span<Hit> hits, Packet<W>& packet) const noexcept {
  const double above_m = 2.0 * everything.slack_m;
  std::array<bool, W> plain{};
  for (std::size_t i = 0; i < W; ++i) {
    const auto [level, facet] = surface.plain_facet_at(packet.u0[i], packet.v0[i]);
    plain[i] = level != nullptr;
    if (plain[i]) packet.take(static_cast<int>(i), *level, facet);
  }
  packet.find_planes();
  rise_over_planes(packet, above_m);
  for (std::size_t i = 0; i < W; ++i) {
    if (!plain[i] || std::isnan(packet.begin_m[i])) {
      packet.begin_m[i] = 0;
      const FacetRay ray = packet.facet_ray(static_cast<int>(i), surface.extent());
      const auto [begin_m, crossing] = surface.escape_surface(ray, above_m);
      packet.begin_m[i] = begin_m;
      if (crossing && i < hits.size()) {
        hits[i] = hit_of(level(0).level.frame, *crossing);
        packet.facets[i] = crossing->facet;
      }
    }
    packet.inner_m[i] = packet.begin_m[i];
  }
}

template <int W>
void RayTracer::Impl::trace_packet(Coherence coherence, Packet<W>& packet,
                                   std::span<Hit> hits) const {
  if (!start_inside(packet)) return trace_target(join_levels(), coherence, hits, packet);
  for (const Target& target : targets) {
    trace_target(target, coherence, hits, packet);
    if (std::ranges::all_of(hits, [](const Hit& hit) { return static_cast<bool>(hit); })) return;
  }
}

template <int W>
void RayTracer::Impl::trace(std::span<const Ray> rays, std::span<Hit> hits, Batch batch,
                            std::span<GroundFacet> facets) const {
  const Coherence coherence =
      batch == Batch::Scattered ? Coherence::Incoherent : Coherence::Coherent;
  Packet<W> packet;
  std::ranges::fill(hits, Hit{});
  for (std::size_t begin = 0; begin < rays.size(); begin += W) {
    const std::size_t count = std::min<std::size_t>(W, rays.size() - begin);
    take_rays(level(0).level.frame, rays.subspan(begin, count), packet);
    if (batch != Batch::Alike) escape_surface(hits.subspan(begin, count), packet);
    trace_packet(coherence, packet, hits.subspan(begin, count));
    if (!facets.empty())
      std::ranges::copy_n(packet.facets.begin(), static_cast<std::ptrdiff_t>(count),
                          facets.begin() + static_cast<std::ptrdiff_t>(begin));
  }
}

RayTracer::RayTracer(const RayDevice& device, std::vector<LevelScene> levels)
    : impl_(std::make_unique<Impl>(device, std::move(levels))) {}

RayTracer::RayTracer(std::vector<Level> levels, const glm::dvec3& p_DL, Tracing tracing,
                     const std::string& device_config) {
  const RayDevice device(device_config);
  std::vector<LevelScene> scenes;
  for (Level& level : levels) scenes.emplace_back(device, std::move(level), p_DL, tracing);
  impl_ = std::make_unique<Impl>(device, std::move(scenes));
}

RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::trace(std::span<const Ray> rays, std::span<Hit> hits, Batch batch,
                      std::span<GroundFacet> facets) const {
  const FlushDenormals flush;
  with_packet_width(impl_->device,
                    [&](auto width) { impl_->trace<width>(rays, hits, batch, facets); });
}

void RayTracer::bound_errors(std::span<const Ray> rays, std::span<const Hit> hits,
                             std::span<double> bounds_m) const noexcept {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const GridFrame& frame = impl_->level(0).level.frame;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto band =
        impl_->surface.error_band(frame.to_grid(rays[i].origin, rays[i].direction),
                                  hits[i].object == 0 ? rays[i].far_m : hits[i].range_m);
    const double range_m = hits[i].range_m;
    const double rounding_m = 1e-9 * range_m + 1e-9;  // accuracy of ranges themselves
    if (!band.is_certain) {
      bounds_m[i] = infinity;
    } else if (hits[i].object != 0) {
      bounds_m[i] = std::max(range_m - band.near_m, 0.0) + rounding_m;
    } else if (!hits[i]) {
      bounds_m[i] = band.near_m < infinity ? infinity : 0;
    } else {
      bounds_m[i] = std::max(range_m - band.near_m, band.far_m - range_m) + rounding_m;
    }
  }
}

std::span<const LevelScene> RayTracer::levels() const noexcept { return impl_->scenes; }
const RayDevice& RayTracer::device() const noexcept { return impl_->device; }

glm::dvec3 float_frame_origin(const glm::dvec3& viewpoint) {
  return glm::round(viewpoint / 2048.0) * 2048.0;
}

}  // namespace groundray
