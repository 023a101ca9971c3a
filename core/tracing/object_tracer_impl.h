#pragma once

// Private to tracing: what a tracer of objects holds, for its two sources.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/tracing/device.h"
#include "core/tracing/object_box.h"
#include "core/tracing/object_tracer.h"

namespace groundray {

inline double seconds(std::chrono::nanoseconds time) noexcept {
  return std::chrono::duration<double>(time).count();
}

struct ObjectTracer::Impl {
  RayDevice device;
  std::vector<ModelScene> models;
  std::vector<PlacedObject> placed;
  std::vector<MovingObject> moving;
  std::vector<std::uint32_t> first_parts;  // of the moving instances: indices in `moving`
  std::vector<Sway> sways;                 // by model; empty if nothing sways
  // Interval mapped to Embree's times 0 to 1: from the first pose of any trajectory to the last.
  std::chrono::nanoseconds begin_time{0}, end_time{0};
  std::size_t time_steps = 1;
  std::vector<ObjectBox> moving_boxes;  // of all moving objects, at each time step
  ObjectBox box;                        // of all objects
  glm::dvec3 p_DC{0};                   // origin of the scene's floats: the centre of `box`
  float slack_m = 0;                    // padding that covers rounding to float
  Owned<RTCScene> scene;

  Impl(const RayDevice& with, std::vector<ModelScene> what, std::vector<PlacedObject> standing,
       std::vector<MovingObject> going, std::vector<Sway> swaying);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  const ModelScene::Impl& model(std::uint32_t number) const noexcept {
    return models[number].impl();
  }
  bool is_still(const PlacedObject& object) const noexcept {
    return sways.empty() || sways[object.model].is_still();
  }
  ObjectBox box_of(const PlacedObject& object) const noexcept {
    const Sway* const sway = is_still(object) ? nullptr : &sways[object.model];
    return groundray::box_of(model(object.model), object, sway);
  }
  void find_moving_boxes();
  std::chrono::nanoseconds time_of(std::size_t step) const noexcept {
    if (time_steps == 1) return begin_time;
    const double share = static_cast<double>(step) / static_cast<double>(time_steps - 1);
    return begin_time + std::chrono::nanoseconds(std::llround(
                            share * static_cast<double>((end_time - begin_time).count())));
  }
  float share_of(std::chrono::nanoseconds time) const noexcept {
    if (begin_time == end_time) return 0;
    const double share = static_cast<double>((time - begin_time).count()) /
                         static_cast<double>((end_time - begin_time).count());
    return static_cast<float>(std::clamp(share, 0.0, 1.0));
  }
  Pose pose(const MovingObject& object, std::chrono::nanoseconds time) const {
    const Trajectory& X_DO = object.X_DO;
    return X_DO.pose_at(std::clamp(time, X_DO.begin_time(), X_DO.end_time()));
  }
  RTCBounds bounds(const ObjectBox& of) const noexcept {
    const glm::vec3 low = glm::vec3(of.low - p_DC) - slack_m;
    const glm::vec3 high = glm::vec3(of.high - p_DC) + slack_m;
    return {low.x, low.y, low.z, 0, high.x, high.y, high.z, 0};
  }
  void build();

  template <int W>
  static void meet_placed(const RTCIntersectFunctionNArguments* arguments);
  template <int W>
  static void meet_swaying(const RTCIntersectFunctionNArguments* arguments);
  template <int W>
  static void meet_moving(const RTCIntersectFunctionNArguments* arguments);
  static void placed_bounds(const RTCBoundsFunctionArguments* arguments);
  static void moving_bounds(const RTCBoundsFunctionArguments* arguments);
  template <int W>
  void trace_packet(std::span<const Ray> rays, std::span<Hit> hits) const noexcept;
  template <int W>
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept;
};

}  // namespace groundray
