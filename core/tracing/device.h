#pragma once

#include <atomic>
#include <cstddef>
#include <span>
#include <string_view>

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

/// Returns an empty scene with RTC_SCENE_FLAG_ROBUST, which all scenes must have.
RTCScene new_scene(const RayDevice& device);

/// Builds a scene from the attached geometries. May be called from a parallel task, even if the
/// task's context ends before the scene is released.
void commit(RTCScene scene);

/// Returns a scene with `scenes` as instances, numbered in their order. Their transforms are the
/// identity: any other would round the rays differently in each instance.
RTCScene instance_all(const RayDevice& device, std::span<const RTCScene> scenes);

/// @throws Error if Embree has failed since the last check.
void check(const RayDevice& device, std::string_view doing);

}  // namespace groundray
