#pragma once

#include <atomic>
#include <cstddef>
#include <span>
#include <string_view>

#include "core/embree_adapter.h"
#include "core/ray_tracer.h"

namespace groundray {

struct RayDevice::Impl {
  RTCDevice device = nullptr;
  int width = 4;  ///< of native packets
  mutable std::atomic<std::ptrdiff_t> bytes{0};

  ~Impl() { rtcReleaseDevice(device); }
};

inline RTCDevice handle(const RayDevice& device) noexcept { return device.impl().device; }

/// Returns an empty scene as all of ours are: robust.
RTCScene new_scene(const RayDevice& device);

/// Builds what was attached to a scene; within a thread's parallel work too, which may end before
/// the scene does.
void commit(RTCScene scene);

/// Returns a scene of scenes, numbered as they come. Their transforms are the identity: any other
/// would round the rays in each of them in its own way.
RTCScene instance_all(const RayDevice& device, std::span<const RTCScene> scenes);

/// @throws Error if Embree failed since it was asked last.
void check(const RayDevice& device, std::string_view doing);

}  // namespace groundray
