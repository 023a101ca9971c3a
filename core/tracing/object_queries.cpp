// What a tracer of objects tells about them.
#include <algorithm>
#include <array>
#include <chrono>
#include <glm/geometric.hpp>

#include "core/tracing/object_tracer.h"
#include "core/tracing/object_tracer_impl.h"

namespace groundray {

using std::chrono::nanoseconds;

bool ObjectTracer::any_moves() const noexcept {
  return impl_ != nullptr && (!impl_->moving.empty() || !impl_->sways.empty());
}

std::uint32_t ObjectTracer::instance_of(std::uint32_t object) const noexcept {
  const auto standing = static_cast<std::uint32_t>(impl_->placed.size());
  if (object <= standing) return object;
  const auto next = std::ranges::upper_bound(impl_->first_parts, object - standing - 1);
  return standing + static_cast<std::uint32_t>(next - impl_->first_parts.begin());
}

ObjectRange ObjectTracer::parts_of(std::uint32_t instance) const noexcept {
  const auto standing = static_cast<std::uint32_t>(impl_->placed.size());
  if (instance <= standing) return {instance, 1};
  const auto& first = impl_->first_parts;
  const std::size_t i = instance - standing - 1;
  const std::size_t end = i + 1 < first.size() ? first[i + 1] : impl_->moving.size();
  return {standing + first[i] + 1, static_cast<std::uint32_t>(end - first[i])};
}

std::uint32_t ObjectTracer::part_at(std::uint32_t instance, const glm::dvec3& p_DQ,
                                    const glm::dvec3& normal, nanoseconds time) const noexcept {
  const ObjectRange parts = parts_of(instance);
  if (parts.count == 1) return parts.first;
  // A hit is within the error of a range of its part; the mean over a beam is farther off.
  for (const double off_m : {1e-3, 1e-2, 0.1, 0.5}) {
    const std::array<Ray, 1> ray{{{p_DQ + off_m * normal, -normal, 2 * off_m, time}}};
    std::array<Hit, 1> hit{};
    trace(ray, hit);
    if (parts.first <= hit[0].object && hit[0].object < parts.first + parts.count)
      return hit[0].object;
  }
  return parts.first;
}

std::uint32_t ObjectTracer::model_of(std::uint32_t object) const noexcept {
  const std::size_t index = object - 1;
  return index < impl_->placed.size() ? impl_->placed[index].model
                                      : impl_->moving[index - impl_->placed.size()].model;
}

PlacedObject ObjectTracer::placed_at(std::uint32_t object, nanoseconds time) const noexcept {
  const std::size_t index = object - 1;
  if (index < impl_->placed.size()) return impl_->placed[index];
  const MovingObject& moving = impl_->moving[index - impl_->placed.size()];
  const Pose X_DO = impl_->pose(moving, time);
  return {X_DO.translation_m, X_DO.rotation, moving.scale, moving.model};
}

Lean ObjectTracer::lean(std::uint32_t object, nanoseconds time) const noexcept {
  const std::size_t index = object - 1;
  if (index >= impl_->placed.size() || impl_->is_still(impl_->placed[index])) return {};
  const PlacedObject& placed = impl_->placed[index];
  return impl_->sways[placed.model].lean(glm::dvec2(placed.p_DO), placed.scale, seconds(time));
}

ObjectTracer ObjectTracer::only(std::uint32_t instance) const {
  const auto [first, count] = parts_of(instance);
  std::vector<ModelScene> models;
  std::vector<Sway> sways;
  std::vector<PlacedObject> placed;
  std::vector<MovingObject> moving;
  for (std::uint32_t part = first; part < first + count; ++part) {
    const std::uint32_t model = model_of(part);
    const auto own = static_cast<std::uint32_t>(models.size());
    models.push_back(impl_->models[model]);
    if (!impl_->sways.empty()) sways.push_back(impl_->sways[model]);
    const std::size_t index = part - 1;
    if (index < impl_->placed.size()) {
      placed.push_back(impl_->placed[index]);
      placed.back().model = own;
    } else {
      moving.push_back(impl_->moving[index - impl_->placed.size()]);
      moving.back().model = own;
    }
  }
  return {impl_->device, std::move(models), std::move(placed), std::move(moving), std::move(sways)};
}

std::span<const ModelScene> ObjectTracer::models() const noexcept {
  if (impl_ == nullptr) return {};
  return impl_->models;
}

glm::dvec3 ObjectTracer::velocity_m_s(std::uint32_t object, const glm::dvec3& p_DQ,
                                      nanoseconds time) const noexcept {
  const std::size_t index = object - 1;
  if (index < impl_->placed.size()) {
    const PlacedObject& placed = impl_->placed[index];
    if (impl_->is_still(placed)) return glm::dvec3(0);
    return impl_->sways[placed.model].velocity_m_s(glm::dvec2(placed.p_DO), placed.scale,
                                                   seconds(time), p_DQ.z - placed.p_DO.z);
  }
  const Trajectory& X_DO = impl_->moving[index - impl_->placed.size()].X_DO;
  if (time < X_DO.begin_time() || X_DO.end_time() < time) return glm::dvec3(0);
  const auto [linear_m_s, angular_rad_s] = X_DO.velocity_at(time);
  return linear_m_s + glm::cross(angular_rad_s, p_DQ - X_DO.pose_at(time).translation_m);
}

}  // namespace groundray
