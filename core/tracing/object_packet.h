#pragma once

// Packets of rays that are traced through objects, and through the model of one object.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include "core/tracing/level_scene.h"
#include "core/tracing/model_scene.h"

namespace groundray {

// Transformation of a ray from D to a model's frame O.
struct ObjectFromWorld {
  glm::dmat3 per_D{1};  // R_OD / scale
  glm::dvec3 p_DO{0};
};

inline ObjectFromWorld into_model(const glm::dquat& R_DO, const glm::dvec3& p_DO,
                                  double scale) noexcept {
  return {glm::transpose(glm::mat3_cast(R_DO)) * (1 / scale), p_DO};
}

// A packet of rays traced through the objects, with one array over the lanes for each number.
template <int W>
struct ObjectPacket {
  using Doubles = std::array<double, W>;

  alignas(64) PacketOf<W> floats;
  alignas(64) std::array<int, W> valid;
  alignas(64) Doubles x_m, y_m, z_m, dx, dy, dz;
  Doubles enter_m;  // range at which the float rays begin
  std::array<std::chrono::nanoseconds, W> time;
  // Nearest hit so far:
  Doubles best_m;
  std::array<std::uint32_t, W> object, triangle;
  std::array<glm::vec3, W> normal;
};

// The rays of a packet in a model's frame.
template <int W>
struct LocalPacket {
  using Doubles = std::array<double, W>;

  alignas(64) PacketOf<W> floats;
  alignas(64) std::array<int, W> valid;
  alignas(64) Doubles x, y, z, dx, dy, dz;
  Doubles enter_m, leave_m;
  std::array<ModelRay, W> rays;  // read by Embree's callbacks
  std::array<ModelCrossing, W> crossings;

  ModelRay ray(std::size_t i) const noexcept { return {{x[i], y[i], z[i]}, {dx[i], dy[i], dz[i]}}; }
};

// Transforms a ray to a model's frame.
template <int W>
inline void transform_ray(const ObjectFromWorld& into, const ObjectPacket<W>& packet, std::size_t i,
                          LocalPacket<W>& local) noexcept {
  const glm::dmat3& m = into.per_D;
  const double x = packet.x_m[i] - into.p_DO.x;
  const double y = packet.y_m[i] - into.p_DO.y;
  const double z = packet.z_m[i] - into.p_DO.z;
  local.x[i] = m[0].x * x + m[1].x * y + m[2].x * z;
  local.y[i] = m[0].y * x + m[1].y * y + m[2].y * z;
  local.z[i] = m[0].z * x + m[1].z * y + m[2].z * z;
  local.dx[i] = m[0].x * packet.dx[i] + m[1].x * packet.dy[i] + m[2].x * packet.dz[i];
  local.dy[i] = m[0].y * packet.dx[i] + m[1].y * packet.dy[i] + m[2].y * packet.dz[i];
  local.dz[i] = m[0].z * packet.dx[i] + m[1].z * packet.dy[i] + m[2].z * packet.dz[i];
}

// Keeps those lanes valid that intersect the model's bounding box before their nearest hit so far.
// The box is padded, so that a ray along one of its sides, which produces NaNs here, is kept.
template <int W>
bool enter_box(const ModelScene::Impl& model, const ObjectPacket<W>& packet,
               LocalPacket<W>& local) noexcept {
  const glm::dvec3 low = model.low_m - double{model.slack_m};
  const glm::dvec3 high = model.high_m + double{model.slack_m};
  int any = 0;
  for (std::size_t i = 0; i < W; ++i) {
    const double ix = 1 / local.dx[i], iy = 1 / local.dy[i], iz = 1 / local.dz[i];
    const double xa = (low.x - local.x[i]) * ix, xb = (high.x - local.x[i]) * ix;
    const double ya = (low.y - local.y[i]) * iy, yb = (high.y - local.y[i]) * iy;
    const double za = (low.z - local.z[i]) * iz, zb = (high.z - local.z[i]) * iz;
    const double enter_m =
        std::max(std::max(0.0, std::min(xa, xb)), std::max(std::min(ya, yb), std::min(za, zb)));
    const double leave_m = std::min(std::min(packet.best_m[i], std::max(xa, xb)),
                                    std::min(std::max(ya, yb), std::max(za, zb)));
    const bool passes = enter_m <= leave_m;
    local.valid[i] &= passes ? -1 : 0;
    local.enter_m[i] = passes ? enter_m : 0;  // finite: Embree reads all lanes
    local.leave_m[i] = passes ? leave_m : 0;
    any |= local.valid[i];
  }
  return any != 0;
}

template <int W>
void fill_floats(const ModelScene::Impl& model, LocalPacket<W>& local) noexcept {
  auto& out = local.floats.ray;
  const glm::dvec3 centre_m = model.centre_m;
  for (std::size_t i = 0; i < W; ++i) {
    const double begin_m = local.enter_m[i];
    out.org_x[i] = static_cast<float>(local.x[i] + local.dx[i] * begin_m - centre_m.x);
    out.org_y[i] = static_cast<float>(local.y[i] + local.dy[i] * begin_m - centre_m.y);
    out.org_z[i] = static_cast<float>(local.z[i] + local.dz[i] * begin_m - centre_m.z);
    out.dir_x[i] = direction_float(local.dx[i]);
    out.dir_y[i] = direction_float(local.dy[i]);
    out.dir_z[i] = direction_float(local.dz[i]);
    out.tnear[i] = 0;
    out.tfar[i] = far_float(local.leave_m[i] - begin_m, model.slack_m);
    out.time[i] = 0;
    out.mask[i] = ~0u;
    out.id[i] = static_cast<unsigned>(i);
    out.flags[i] = 0;
    local.floats.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    local.floats.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
}

// Continues behind a triangle that Embree reported but that the ray misses in double.
inline ModelCrossing search(const ModelScene::Impl& model, const ModelRay& ray, double enter_m,
                            double leave_m, float from_m) noexcept {
  const glm::vec3 origin(ray.origin + ray.direction * enter_m - model.centre_m);
  const glm::vec3 direction(direction_float(ray.direction.x), direction_float(ray.direction.y),
                            direction_float(ray.direction.z));
  const float far_m = far_float(leave_m - enter_m, model.slack_m);
  for (;;) {
    RTCRayHit one{};
    const float next_m = from_m * (1 + 0x1p-22f) + 0x1p-6f * model.slack_m;
    one.ray = {origin.x,    origin.y, origin.z, next_m, direction.x, direction.y,
               direction.z, 0,        far_m,    ~0u,    0,           0};
    one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    ModelQuery query{{}, &ray};
    if (!(next_m < far_m)) return {};
    intersect<1>(model.scene.get(), nullptr, one, query.context, Coherence::Incoherent);
    if (one.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    const std::uint32_t named = model.triangle_of(one.hit.geomID, one.hit.primID);
    if (const auto met = model.intersect(named, ray)) return met;
    if (const auto met = model.meet_beside(named, ray)) return met;
    from_m = one.ray.tfar;
  }
}

// Returns the intersection of a lane's ray with the model.
template <int W>
ModelCrossing crossing_of(const ModelScene::Impl& model, const LocalPacket<W>& local,
                          std::size_t i) noexcept {
  if (model.tracing == Tracing::Exact) return local.crossings[i];
  const auto& hit = local.floats.hit;
  if (hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) return {};
  const ModelRay ray = local.ray(i);
  const std::uint32_t named = model.triangle_of(hit.geomID[i], hit.primID[i]);
  const float at_m = local.floats.ray.tfar[i];
  if (const auto met = model.intersect(named, ray)) return met;
  const auto beside = model.meet_beside(named, ray);
  // Another triangle may lie in between.
  const double end_m = beside ? beside.t_m : local.leave_m[i];
  return std::min(beside, search(model, ray, local.enter_m[i], end_m, at_m));
}

// Intersects the valid lanes of `local` with a model; each lane has its own transformation `into`.
template <int W>
void intersect(const ModelScene::Impl& model, std::uint32_t object,
               const std::array<const ObjectFromWorld*, W>& into, LocalPacket<W>& local,
               ObjectPacket<W>& packet) noexcept {
  if (!enter_box(model, packet, local)) return;
  fill_floats(model, local);
  if (model.tracing == Tracing::Exact || !model.cut.empty()) {
    for (std::size_t i = 0; i < W; ++i) local.rays[i] = local.ray(i);
  }
  if (model.tracing == Tracing::Exact) local.crossings.fill({});
  ModelQuery query{{}, local.rays.data(), local.enter_m.data(), local.crossings.data()};
  // Coherent traversal tests each triangle with all lanes, which pays if most of them are valid.
  const auto idle = std::ranges::count(local.valid, 0);
  intersect<W>(model.scene.get(), local.valid.data(), local.floats, query.context,
               idle <= W / 4 ? Coherence::Coherent : Coherence::Incoherent);
  for (std::size_t i = 0; i < W; ++i) {
    if (local.valid[i] == 0) continue;
    const auto crossing = crossing_of(model, local, i);
    const bool is_nearer = crossing.t_m < packet.best_m[i] ||
                           (crossing.t_m == packet.best_m[i] && object < packet.object[i]);
    if (!crossing || !is_nearer) continue;
    const glm::dvec3 d_D(packet.dx[i], packet.dy[i], packet.dz[i]);
    const glm::dvec3 up =
        glm::normalize(glm::transpose(into[i]->per_D) * model.normal(crossing.triangle));
    packet.best_m[i] = crossing.t_m;
    packet.object[i] = object;
    packet.triangle[i] = crossing.triangle;
    packet.normal[i] = glm::vec3(glm::dot(up, d_D) > 0 ? -up : up);
  }
}

}  // namespace groundray
