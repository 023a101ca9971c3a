#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"
#include "core/tracing/object_tracer.h"
#include "sensors/camera/camera.h"

// Positions and times at which an image sees moving points, private to this library.
namespace groundray {

/// Point of a surface that may move, or a direction to the sky.
class Mover {
 public:
  /// Constructs a point that is fixed to an object.
  /// @param object  its number; 0 for the ground.
  /// @param p_DQ    position of the point at `time`.
  Mover(const ObjectTracer& objects, std::uint32_t object, const glm::dvec3& p_DQ,
        std::chrono::nanoseconds time);
  /// Constructs the point that a ray hit, or the direction of a ray that missed.
  Mover(const ObjectTracer& objects, const Ray& ray, const Hit& hit);

  bool is_sky() const noexcept { return is_sky_; }

  /// Returns the vector to the point from a viewpoint, axes of D; for sky, the direction.
  glm::dvec3 seen_from(const glm::dvec3& p_DC, std::chrono::nanoseconds time) const noexcept;

 private:
  const ObjectTracer& objects_;
  std::uint32_t object_;
  bool is_sky_;
  glm::dvec3 p_;  // in D, or in the upright object's frame at D's scale; for sky, the direction
};

/// Observation of a point by an image.
struct Observation {
  glm::dvec2 pixel{0};               ///< inside the image or not
  std::chrono::nanoseconds time{0};  ///< middle of its row's exposure
  Pose X_DC;                         ///< pose of the camera at that time
  glm::dvec3 towards{0};  ///< vector from the camera to the point, axes of D; unit for sky
};

/// Returns the observation of a point in the middle of its row's exposure; a point above or below
/// the image uses the first or last row. Row and time depend on each other and are iterated until
/// the time changes by at most 1 ns: a few steps with a rolling shutter, one with a global shutter.
/// nullopt if the point is not imaged, or moves faster than the rows.
/// @param begin  start of the image; X_DC covers it.
/// @param row    first guess of the row.
std::optional<Observation> observe(const Camera& camera, const Trajectory& X_DC,
                                   std::chrono::nanoseconds begin, const Mover& point, double row);

/// Returns true if a position lies on one of an image's pixels.
bool is_inside(glm::ivec2 size_px, const glm::dvec2& pixel) noexcept;

}  // namespace groundray
