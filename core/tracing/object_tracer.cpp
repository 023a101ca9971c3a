// Embree determines the objects that a ray may hit. Each is then intersected in its model's frame,
// where floats are precise enough to select the triangle; the intersection itself is computed in
// double.
#include "core/tracing/object_tracer.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <utility>

#include "core/error.h"
#include "core/tracing/device.h"
#include "core/tracing/object_box.h"
#include "core/tracing/object_packet.h"
#include "core/tracing/object_tracer_impl.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr unsigned placed_geometry = 0;
constexpr unsigned moving_geometry = 1;
// Embree silently omits anything beyond 1.8e18, and one distant object makes all floats coarse.
constexpr double most_m = 1e9;

// Embree's maximum number of time steps, at which it receives the boxes of moving objects.
constexpr std::size_t most_time_steps = RTC_MAX_TIME_STEP_COUNT;

// Arguments of Embree's callbacks.
template <int W>
struct ObjectQuery {
  QueryContext context;  // first, so that Embree's pointer to it is a pointer to this
  ObjectPacket<W>* packet;
};

void check_objects(std::span<const ModelScene> models, std::span<const PlacedObject> placed,
                   std::span<const MovingObject> moving) {
  Violations broken("objects");
  const auto check = [&](std::size_t number, double scale, std::uint32_t model, double away_m) {
    const bool scales = scale > 0 && std::isfinite(scale);
    broken.unless(scales, "object {}: its scale = {} must be positive and finite", number, scale);
    broken.unless(model < models.size(), "object {}: model {} does not exist; there are {} models",
                  number, model, models.size());
    if (!scales || model >= models.size() || std::isnan(away_m)) return;
    const double reach_m = away_m + scale * models[model].impl().radius_m;
    broken.unless(reach_m <= most_m,
                  "object {}: it reaches {:.3g} m from the origin; it must stay within {:.0e} m: "
                  "are its position and size in metres?",
                  number, reach_m, most_m);
  };
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const PlacedObject& object = placed[i];
    check(i + 1, object.scale, object.model, glm::length(object.p_DO));
    broken.unless(std::isfinite(object.p_DO.x + object.p_DO.y + object.p_DO.z),
                  "object {}: its position must be finite", i + 1);
    broken.unless(std::abs(glm::length(object.R_DO) - 1) <= 1e-9,
                  "object {}: its rotation has a quaternion of norm {}; it must be 1", i + 1,
                  glm::length(object.R_DO));
  }
  for (std::size_t i = 0; i < moving.size(); ++i) {
    double away_m = 0;
    for (const Trajectory::Sample& sample : moving[i].X_DO.samples())
      away_m = std::max(away_m, glm::length(sample.pose.translation_m));
    check(placed.size() + i + 1, moving[i].scale, moving[i].model, away_m);
  }
  broken.throw_if_any();
}

// Clips the interval [begin_m, end_m] of a ray to a box; leaves begin_m > end_m if the ray misses
// it.
void clip(const glm::dvec3& origin, const glm::dvec3& direction, const glm::dvec3& low,
          const glm::dvec3& high, double& begin_m, double& end_m) noexcept {
  for (int k = 0; k < 3; ++k) clip_range(origin[k], direction[k], low[k], high[k], begin_m, end_m);
}

}  // namespace

// Embree interpolates boxes linearly between time steps. The box at a step contains all positions
// of the object from the previous step to the next one, with a margin because Embree's times are
// floats. Therefore the boxes of two adjacent steps both contain everything between them.
void ObjectTracer::Impl::find_moving_boxes() {
  if (moving.empty()) return;
  begin_time = nanoseconds::max();
  end_time = nanoseconds::min();
  for (const MovingObject& object : moving) {
    begin_time = std::min(begin_time, object.X_DO.begin_time());
    end_time = std::max(end_time, object.X_DO.end_time());
  }
  time_steps = begin_time == end_time ? 1 : most_time_steps;
  const nanoseconds slack = (end_time - begin_time) / 1'000'000;
  std::vector<nanoseconds> times;
  for (std::size_t step = 0; step < time_steps; ++step) times.push_back(time_of(step));
  for (const MovingObject& object : moving) {
    const double ball_m = object.scale * model(object.model).radius_m;
    const std::vector<ObjectStretch> stretches = stretches_of(object.X_DO, ball_m, times);
    for (std::size_t step = 0; step < time_steps; ++step) {
      const bool is_first = step == 0, is_last = step + 1 == time_steps;
      const nanoseconds begin = is_first ? nanoseconds::min() : time_of(step - 1) - slack;
      const nanoseconds end = is_last ? nanoseconds::max() : time_of(step + 1) + slack;
      ObjectBox& all = moving_boxes.emplace_back();
      for (const ObjectStretch& stretch : stretches) {
        if (stretch.begin <= end && begin <= stretch.end) all.add(stretch.box);
      }
      box.add(all);
    }
  }
}

ObjectTracer::Impl::Impl(const RayDevice& with, std::vector<ModelScene> what,
                         std::vector<PlacedObject> standing, std::vector<MovingObject> going,
                         std::vector<Sway> swaying)
    : device(with), models(std::move(what)), placed(std::move(standing)), moving(std::move(going)) {
  check_objects(models, placed, moving);
  for (std::uint32_t i = 0; i < moving.size(); ++i) {
    if (i == 0 || moving[i].body == 0 || moving[i].body != moving[i - 1].body)
      first_parts.push_back(i);
  }
  if (!std::ranges::all_of(swaying, &Sway::is_still)) sways = std::move(swaying);
  for (const PlacedObject& object : placed) box.add(box_of(object));
  find_moving_boxes();
  p_DC = (box.low + box.high) / 2.0;
  slack_m = static_cast<float>(16 * 0x1p-24 * glm::length(box.high - box.low));
  build();
}

void ObjectTracer::Impl::placed_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& tracer = *static_cast<const Impl*>(arguments->geometryUserPtr);
  *arguments->bounds_o = tracer.bounds(tracer.box_of(tracer.placed[arguments->primID]));
}

void ObjectTracer::Impl::moving_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& tracer = *static_cast<const Impl*>(arguments->geometryUserPtr);
  const std::size_t box = arguments->primID * tracer.time_steps + arguments->timeStep;
  *arguments->bounds_o = tracer.bounds(tracer.moving_boxes[box]);
}

void ObjectTracer::Impl::build() {
  scene = new_scene(device);
  const auto add = [&](unsigned id, std::size_t count, std::size_t steps,
                       RTCBoundsFunction bounds_of, RTCIntersectFunctionN intersect) {
    if (count == 0) return;
    attach_primitives(device, scene.get(), id, count, this, bounds_of, intersect, steps);
  };
  with_packet_width(device, [&](auto width) {
    add(placed_geometry, placed.size(), 1, placed_bounds,
        sways.empty() ? meet_placed<width> : meet_swaying<width>);
    add(moving_geometry, moving.size(), time_steps, moving_bounds, meet_moving<width>);
  });
  commit(scene.get());
  check(device, "building the objects");
}

namespace {

// Shrinks tfar to the nearest hit so far.
template <int W>
void shorten(const RTCIntersectFunctionNArguments* arguments, const ObjectPacket<W>& packet,
             float slack_m) noexcept {
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned lane = RTCRayN_id(rays, arguments->N, i);
    float& far_m = RTCRayN_tfar(rays, arguments->N, i);
    far_m = std::min(far_m, far_float(packet.best_m[lane] - packet.enter_m[lane], slack_m));
  }
}

// Calls act(lane) for each valid lane of a callback.
template <typename Act>
void for_each_lane(const RTCIntersectFunctionNArguments* arguments, const Act& act) noexcept {
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] != 0) act(std::size_t{RTCRayN_id(rays, arguments->N, i)});
  }
}

}  // namespace

template <int W>
void ObjectTracer::Impl::meet_placed(const RTCIntersectFunctionNArguments* arguments) {
  const auto& tracer = *static_cast<const Impl*>(arguments->geometryUserPtr);
  auto& packet = *reinterpret_cast<ObjectQuery<W>*>(arguments->context)->packet;
  const PlacedObject& object = tracer.placed[arguments->primID];
  const ModelScene::Impl& model = tracer.model(object.model);
  const ObjectFromWorld into = into_model(object.R_DO, object.p_DO, object.scale);
  std::array<const ObjectFromWorld*, W> all;
  all.fill(&into);
  LocalPacket<W> local;
  local.valid.fill(0);
  for_each_lane(arguments, [&](std::size_t lane) { local.valid[lane] = -1; });
  for (std::size_t i = 0; i < W; ++i) transform_ray(into, packet, i, local);
  intersect<W>(model, arguments->primID + 1, all, local, packet);
  shorten(arguments, packet, tracer.slack_m);
}

// Intersects the object as it leans at each ray's own time. The map to the upright model is linear,
// so rays stay straight, and ranges are as accurate as those of stationary objects.
template <int W>
void ObjectTracer::Impl::meet_swaying(const RTCIntersectFunctionNArguments* arguments) {
  const auto& tracer = *static_cast<const Impl*>(arguments->geometryUserPtr);
  const PlacedObject& object = tracer.placed[arguments->primID];
  if (tracer.is_still(object)) return meet_placed<W>(arguments);
  auto& packet = *reinterpret_cast<ObjectQuery<W>*>(arguments->context)->packet;
  std::array<std::size_t, W> lanes;
  std::array<double, W> times_s;
  std::size_t count = 0;
  for_each_lane(arguments, [&](std::size_t lane) {
    lanes[count] = lane;
    times_s[count++] = seconds(packet.time[lane]);
  });
  const bool is_at_once = std::all_of(times_s.begin(), times_s.begin() + count,
                                      [&](double time_s) { return time_s == times_s[0]; });
  std::array<Lean, W> leans;
  tracer.sways[object.model].lean(glm::dvec2(object.p_DO), object.scale,
                                  std::span(times_s).first(is_at_once ? 1 : count), leans);
  const ObjectFromWorld upright = into_model(object.R_DO, object.p_DO, object.scale);
  std::array<ObjectFromWorld, W> into;
  std::array<const ObjectFromWorld*, W> all;
  LocalPacket<W> local;
  local.valid.fill(0);
  if (count < W) {
    for (std::size_t i = 0; i < W; ++i) transform_ray(upright, packet, i, local);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t lane = lanes[i];
    into[lane] = upright;
    into[lane].per_D[2] = upright.per_D * leans[is_at_once ? 0 : i].upright({0, 0, 1});
    all[lane] = &into[lane];
    local.valid[lane] = -1;
    transform_ray(into[lane], packet, lane, local);
  }
  intersect<W>(tracer.model(object.model), arguments->primID + 1, all, local, packet);
  shorten(arguments, packet, tracer.slack_m);
}

template <int W>
void ObjectTracer::Impl::meet_moving(const RTCIntersectFunctionNArguments* arguments) {
  const auto& tracer = *static_cast<const Impl*>(arguments->geometryUserPtr);
  auto& packet = *reinterpret_cast<ObjectQuery<W>*>(arguments->context)->packet;
  const MovingObject& object = tracer.moving[arguments->primID];
  const ModelScene::Impl& model = tracer.model(object.model);
  std::array<ObjectFromWorld, W> into;
  std::array<const ObjectFromWorld*, W> all;
  LocalPacket<W> local;
  local.valid.fill(0);
  for (std::size_t i = 0; i < W; ++i) transform_ray(ObjectFromWorld{}, packet, i, local);
  for_each_lane(arguments, [&](std::size_t lane) {
    const Pose X_DO = tracer.pose(object, packet.time[lane]);
    into[lane] = into_model(X_DO.rotation, X_DO.translation_m, object.scale);
    all[lane] = &into[lane];
    local.valid[lane] = -1;
    transform_ray(into[lane], packet, lane, local);
  });
  const auto number = static_cast<std::uint32_t>(tracer.placed.size() + arguments->primID + 1);
  intersect<W>(model, number, all, local, packet);
  shorten(arguments, packet, tracer.slack_m);
}

template <int W>
void ObjectTracer::Impl::trace_packet(std::span<const Ray> rays,
                                      std::span<Hit> hits) const noexcept {
  ObjectPacket<W> packet;
  auto& out = packet.floats.ray;
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    double begin_m = 0;
    double end_m = i < rays.size() ? std::min(ray.far_m, hits[i].range_m) : -1.0;
    packet.best_m[i] = end_m;
    clip(ray.origin, ray.direction, box.low, box.high, begin_m, end_m);
    packet.valid[i] = begin_m <= end_m ? -1 : 0;
    if (packet.valid[i] == 0) begin_m = end_m = 0;
    any |= packet.valid[i] != 0;
    packet.enter_m[i] = begin_m;
    packet.object[i] = ~0u;
    packet.time[i] = ray.time;
    packet.x_m[i] = ray.origin.x;
    packet.y_m[i] = ray.origin.y;
    packet.z_m[i] = ray.origin.z;
    packet.dx[i] = ray.direction.x;
    packet.dy[i] = ray.direction.y;
    packet.dz[i] = ray.direction.z;
    const glm::vec3 origin(ray.origin + ray.direction * begin_m - p_DC);
    out.org_x[i] = origin.x;
    out.org_y[i] = origin.y;
    out.org_z[i] = origin.z;
    out.dir_x[i] = direction_float(ray.direction.x);
    out.dir_y[i] = direction_float(ray.direction.y);
    out.dir_z[i] = direction_float(ray.direction.z);
    out.tnear[i] = 0;
    out.tfar[i] = far_float(end_m - begin_m, slack_m);
    out.time[i] = share_of(ray.time);
    out.mask[i] = ~0u;
    out.id[i] = static_cast<unsigned>(i);
    out.flags[i] = 0;
    packet.floats.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.floats.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  if (!any) return;
  ObjectQuery<W> query{{}, &packet};
  intersect<W>(scene.get(), packet.valid.data(), packet.floats, query.context, Coherence::Coherent);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (packet.object[i] == ~0u) continue;
    hits[i] = {packet.best_m[i], packet.normal[i], 0, packet.triangle[i], packet.object[i]};
  }
}

template <int W>
void ObjectTracer::Impl::trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept {
  for (std::size_t begin = 0; begin < rays.size(); begin += W) {
    const std::size_t count = std::min<std::size_t>(W, rays.size() - begin);
    trace_packet<W>(rays.subspan(begin, count), hits.subspan(begin, count));
  }
}

ObjectTracer::ObjectTracer(const RayDevice& device, std::vector<ModelScene> models,
                           std::vector<PlacedObject> placed, std::vector<MovingObject> moving,
                           std::vector<Sway> sways)
    : impl_(std::make_shared<Impl>(device, std::move(models), std::move(placed), std::move(moving),
                                   std::move(sways))) {}

void ObjectTracer::trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept {
  if (size() == 0) return;
  const FlushDenormals flush;
  with_packet_width(impl_->device, [&](auto width) { impl_->trace<width>(rays, hits); });
}

std::size_t ObjectTracer::size() const noexcept {
  return impl_ == nullptr ? 0 : impl_->placed.size() + impl_->moving.size();
}

}  // namespace groundray
