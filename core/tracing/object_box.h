#pragma once

// Bounding boxes of objects, for ObjectTracer.

#include <chrono>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/tracing/model_scene.h"

namespace groundray {

/// Bounding box in D.
struct ObjectBox {
  glm::dvec3 low{std::numeric_limits<double>::infinity()};
  glm::dvec3 high{-std::numeric_limits<double>::infinity()};
  void add(const ObjectBox& other) noexcept {
    low = glm::min(low, other.low);
    high = glm::max(high, other.high);
  }
};

/// Interval of a moving object's trajectory, and a bounding box of the object over the interval.
struct ObjectStretch {
  std::chrono::nanoseconds begin{0}, end{0};
  ObjectBox box;
};

/// Returns the bounding box of a stationary object, over all times if it sways.
/// @param sway  null if it does not.
ObjectBox box_of(const ModelScene::Impl& shape, const PlacedObject& object,
                 const Sway* sway) noexcept;

/// Returns all intervals of a trajectory, and those before it and after it.
/// @param ball_m  radius of a ball round O's origin that contains the object.
/// @param times   more times at which intervals end.
std::vector<ObjectStretch> stretches_of(const Trajectory& X_DO, double ball_m,
                                        std::span<const std::chrono::nanoseconds> times);

}  // namespace groundray
