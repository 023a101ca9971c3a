#pragma once

#include <chrono>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/model/model.h"
#include "core/tracing/object_tracer.h"

namespace groundray {

/// Box that contains an instance at one time. Its axes are those of the object's frame O (x
/// forward, y left, z up); for an instance of several parts, z is D's and x the heading of the
/// first part.
struct InstanceBox {
  std::uint32_t instance = 0;  ///< number, from 1
  std::chrono::nanoseconds time{0};
  glm::dvec3 p_DB{0};           ///< centre
  glm::dquat R_DB{1, 0, 0, 0};  ///< rotation from the box's axes to D
  glm::dvec3 size_m{0};         ///< length, width, height
  glm::dvec3 velocity_m_s{0};   ///< of the centre, as fixed to the first part; in D
};

/// Boxes of the instances of a tracer. Immutable; any number of threads may use one, and copies
/// share the tracer.
class InstanceBoxes {
 public:
  /// Constructs the boxes of a tracer without objects.
  InstanceBoxes() = default;
  explicit InstanceBoxes(ObjectTracer objects);

  /// Returns the box of an instance at a time. It is the smallest one with its axes, unless the
  /// object leans in wind: then it contains the leaning box of the upright object.
  InstanceBox at(std::uint32_t instance, std::chrono::nanoseconds time) const;

 private:
  ObjectTracer objects_;
  std::vector<ModelBounds> bounds_;  // by model
};

}  // namespace groundray
