#pragma once

#include <atomic>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>

#include "core/tracing/embree_adapter.h"
#include "core/tracing/ray_tracer.h"

namespace groundray {

struct RayDevice::Impl {
  RTCDevice device = nullptr;
  int width = 4;  ///< of native packets, rays
  mutable std::atomic<std::ptrdiff_t> bytes{0};

  ~Impl() { rtcReleaseDevice(device); }
};

inline RTCDevice handle(const RayDevice& device) noexcept { return device.impl().device; }

/// Returns f(std::integral_constant<int, W>()) for the width W of the device's packets.
template <typename F>
auto with_packet_width(const RayDevice& device, const F& f) {
  const int width = device.impl().width;
  if (width == 16) return f(std::integral_constant<int, 16>());
  if (width == 8) return f(std::integral_constant<int, 8>());
  return f(std::integral_constant<int, 4>());
}

/// Returns an empty scene with RTC_SCENE_FLAG_ROBUST, which all scenes must have.
Owned<RTCScene> new_scene(const RayDevice& device);

/// Builds a scene from the attached geometries. May be called from a parallel task, even if the
/// task's context ends before the scene is released.
void commit(RTCScene scene);

/// Commits a geometry and attaches it to a scene.
void attach(RTCScene scene, const Owned<RTCGeometry>& geometry, unsigned id);

/// Attaches `count` primitives whose bounds and intersections are computed by callbacks.
/// @param data  geometryUserPtr of the callbacks; not written to.
/// @param intersect  null if the scene serves point queries alone.
/// @param time_steps  at which `bounds` is called for each primitive.
void attach_primitives(const RayDevice& device, RTCScene scene, unsigned id, std::size_t count,
                       const void* data, RTCBoundsFunction bounds, RTCIntersectFunctionN intersect,
                       std::size_t time_steps = 1);

/// Returns a scene with `scenes` as instances, numbered in their order. Their transforms are the
/// identity: any other would round the rays differently in each instance.
Owned<RTCScene> instance_all(const RayDevice& device, std::span<const RTCScene> scenes);

/// @throws Error if Embree has failed since the last check.
void check(const RayDevice& device, std::string_view doing);

}  // namespace groundray
