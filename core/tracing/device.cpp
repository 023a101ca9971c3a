#include "core/tracing/device.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <new>

#include "core/error.h"

namespace groundray {
namespace {

int native_width(RTCDevice device) {
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) return 16;
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) return 8;
  return 4;
}

}  // namespace

RayDevice::RayDevice(const std::string& config) {
  auto impl = std::make_shared<Impl>();
  impl->device = rtcNewDevice(config.c_str());
  if (impl->device == nullptr) {
    if (rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    throw Error("ray tracer: Embree cannot create a device with the settings '{}'", config);
  }
  rtcSetDeviceMemoryMonitorFunction(
      impl->device,
      [](void* counter, ssize_t bytes, bool) {
        static_cast<std::atomic<std::ptrdiff_t>*>(counter)->fetch_add(bytes,
                                                                      std::memory_order_relaxed);
        return true;
      },
      &impl->bytes);
  impl->width = native_width(impl->device);
  impl_ = std::move(impl);
}

std::size_t RayDevice::memory_bytes() const {
  return static_cast<std::size_t>(impl_->bytes.load());
}

std::string RayDevice::description() const {
  const auto version = rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_VERSION);
  return fmt::format("Embree {}.{}.{}, packets of {}", version / 10000, version / 100 % 100,
                     version % 100, impl_->width);
}

Owned<RTCScene> new_scene(const RayDevice& device) {
  Owned<RTCScene> scene(rtcNewScene(handle(device)));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

// Each scene of Embree holds a task group, which points to the task_group_context that it was first
// used in. TBB follows that pointer in any later cancellation, so the context must outlive the
// scene: it is never destroyed.
void commit(RTCScene scene) {
  static auto* const context = new tbb::task_group_context(tbb::task_group_context::isolated);
  tbb::parallel_for(
      0, 1, [scene](int) { rtcCommitScene(scene); }, *context);
}

void attach(RTCScene scene, const Owned<RTCGeometry>& geometry, unsigned id) {
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(scene, geometry.get(), id);
}

void attach_primitives(const RayDevice& device, RTCScene scene, unsigned id, std::size_t count,
                       const void* data, RTCBoundsFunction bounds, RTCIntersectFunctionN intersect,
                       std::size_t time_steps) {
  const Owned<RTCGeometry> geometry(rtcNewGeometry(handle(device), RTC_GEOMETRY_TYPE_USER));
  rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(count));
  rtcSetGeometryTimeStepCount(geometry.get(), static_cast<unsigned>(time_steps));
  rtcSetGeometryUserData(geometry.get(), const_cast<void*>(data));
  rtcSetGeometryBoundsFunction(geometry.get(), bounds, nullptr);
  if (intersect != nullptr) rtcSetGeometryIntersectFunction(geometry.get(), intersect);
  attach(scene, geometry, id);
}

Owned<RTCScene> instance_all(const RayDevice& device, std::span<const RTCScene> scenes) {
  Owned<RTCScene> all = new_scene(device);
  for (unsigned i = 0; i < scenes.size(); ++i) {
    const Owned<RTCGeometry> instance(rtcNewGeometry(handle(device), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(instance.get(), scenes[i]);
    attach(all.get(), instance, i);
  }
  commit(all.get());
  return all;
}

void check(const RayDevice& device, std::string_view doing) {
  if (rtcGetDeviceError(handle(device)) == RTC_ERROR_NONE) return;
  throw Error("ray tracer: Embree failed while {}; is there enough memory?", doing);
}

}  // namespace groundray
