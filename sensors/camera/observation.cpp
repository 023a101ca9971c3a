#include "sensors/camera/observation.h"

#include <algorithm>
#include <glm/gtc/quaternion.hpp>

namespace groundray {

using std::chrono::nanoseconds;

Mover::Mover(const ObjectTracer& objects, std::uint32_t object, const glm::dvec3& p_DQ,
             nanoseconds time)
    : objects_(objects), object_(object), is_sky_(false), p_(p_DQ) {
  if (object_ == 0) return;
  const PlacedObject now = objects_.placed_at(object_, time);
  p_ -= now.p_DO;
  if (const Lean lean = objects_.lean(object_, time)) p_ = lean.upright(p_);
  p_ = glm::conjugate(now.R_DO) * p_;
}

Mover::Mover(const ObjectTracer& objects, const Ray& ray, const Hit& hit)
    : Mover(objects, hit ? hit.object : 0,
            hit ? ray.origin + ray.direction * hit.range_m : ray.direction, ray.time) {
  is_sky_ = !hit;
}

glm::dvec3 Mover::seen_from(const glm::dvec3& p_DC, nanoseconds time) const noexcept {
  if (is_sky_) return p_;
  if (object_ == 0) return p_ - p_DC;
  const PlacedObject then = objects_.placed_at(object_, time);
  glm::dvec3 arm = then.R_DO * p_;
  if (const Lean lean = objects_.lean(object_, time)) arm = lean.leaning(arm);
  return then.p_DO + arm - p_DC;
}

std::optional<Observation> observe(const Camera& camera, const Trajectory& X_DC, nanoseconds begin,
                                   const Mover& point, double row) {
  const double last_row = camera.spec().size_px.y - 1;
  const auto time_of = [&](double at) {
    return begin + camera.middle_of(std::clamp(at, 0.0, last_row));
  };
  nanoseconds time = time_of(row);
  constexpr int most_steps = 64;
  for (int step = 0; step < most_steps; ++step) {
    const Pose pose = X_DC.pose_at(time);
    const glm::dvec3 towards = point.seen_from(pose.translation_m, time);
    const auto pixel = camera.lens().project(glm::conjugate(pose.rotation) * towards);
    if (!pixel) return std::nullopt;
    const nanoseconds then = time_of(pixel->y);
    if (std::chrono::abs(then - time) <= nanoseconds(1))
      return Observation{*pixel, time, pose, towards};
    time = then;
  }
  return std::nullopt;
}

bool is_inside(glm::ivec2 size_px, const glm::dvec2& pixel) noexcept {
  return -0.5 <= pixel.x && pixel.x < size_px.x - 0.5 && -0.5 <= pixel.y &&
         pixel.y < size_px.y - 0.5;
}

}  // namespace groundray
