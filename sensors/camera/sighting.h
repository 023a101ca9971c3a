#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "core/object_tracer.h"
#include "core/pose.h"
#include "core/trajectory.h"
#include "sensors/camera/camera.h"

// Where and when an image sees what moves, private to this library.
namespace groundray {

/// A point of a surface as it moves, or a direction to the sky.
class Mover {
 public:
  /// A point that is fixed to an object.
  /// @param object  its number; 0 for the ground.
  /// @param p_DQ    where the point is at `time`.
  Mover(const ObjectTracer& objects, std::uint32_t object, const glm::dvec3& p_DQ,
        std::chrono::nanoseconds time);
  /// What a ray met; of a miss, its direction.
  Mover(const ObjectTracer& objects, const Ray& ray, const Hit& hit);

  bool is_sky() const noexcept { return is_sky_; }

  /// Returns the way to it from a point of view, axes of D; of sky, its direction.
  glm::dvec3 seen_from(const glm::dvec3& p_DC, std::chrono::nanoseconds time) const noexcept;

 private:
  const ObjectTracer& objects_;
  std::uint32_t object_;
  bool is_sky_;
  glm::dvec3 p_;  // in D, or in the object's frame at D's scale; of sky, its direction
};

/// How an image sees a point.
struct Sighting {
  glm::dvec2 pixel{0};               ///< inside the image or not
  std::chrono::nanoseconds time{0};  ///< the middle of its row's exposure
  Pose X_DC;                         ///< then
  glm::dvec3 towards{0};             ///< from the camera, axes of D; unit for sky
};

/// Returns how an image sees a point in the middle of its row's exposure; a point above or below
/// the image, in that of the first or last row. A row sees its points when it is exposed, which is
/// looked for until it stays, to 1 ns: a few steps with a rolling shutter, one with a global one.
/// Nothing if the point is not imaged, or outruns the rows.
/// @param begin  of the image; X_DC covers it.
/// @param row    where to look first.
std::optional<Sighting> sighting(const Camera& camera, const Trajectory& X_DC,
                                 std::chrono::nanoseconds begin, const Mover& point, double row);

/// Whether a place lies on one of an image's pixels.
bool is_inside(glm::ivec2 size_px, const glm::dvec2& pixel) noexcept;

}  // namespace groundray
