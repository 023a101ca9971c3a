#include "core/tracing/instance_box.h"

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <limits>
#include <utility>

#include "core/math.h"

namespace groundray {
namespace {

// Returns the rotation about D's z to the heading of an object.
glm::dquat heading(const glm::dquat& R_DO) noexcept {
  const glm::dvec3 forward = R_DO * glm::dvec3(1, 0, 0);
  const double half_rad = 0.5 * math::atan2(forward.y, forward.x);
  return {math::cos(half_rad), 0, 0, math::sin(half_rad)};
}

std::array<glm::dvec3, 8> box_corners(const ModelBounds& bounds) noexcept {
  std::array<glm::dvec3, 8> corners{};
  for (unsigned i = 0; i < corners.size(); ++i) {
    corners[i] = {(i & 1u) != 0 ? bounds.high_m.x : bounds.low_m.x,
                  (i & 2u) != 0 ? bounds.high_m.y : bounds.low_m.y,
                  (i & 4u) != 0 ? bounds.high_m.z : bounds.low_m.z};
  }
  return corners;
}

// Bounds of points along the axes of a box, about an origin in D.
struct AxisBounds {
  glm::dmat3 R_BD;
  glm::dvec3 origin;
  glm::dvec3 low{std::numeric_limits<double>::infinity()};
  glm::dvec3 high{-std::numeric_limits<double>::infinity()};

  void add(const glm::dvec3& p_D) noexcept {
    const glm::dvec3 p_B = R_BD * (p_D - origin);
    low = glm::min(low, p_B);
    high = glm::max(high, p_B);
  }
};

}  // namespace

InstanceBoxes::InstanceBoxes(ObjectTracer objects) : objects_(std::move(objects)) {
  for (const ModelScene& model : objects_.models())
    bounds_.push_back(bounds_of(model.model().mesh));
}

InstanceBox InstanceBoxes::at(std::uint32_t instance, std::chrono::nanoseconds time) const {
  const auto [first, count] = objects_.parts_of(instance);
  const PlacedObject root = objects_.placed_at(first, time);
  const glm::dquat R_DB = count == 1 ? root.R_DO : heading(root.R_DO);
  AxisBounds bounds{.R_BD = glm::transpose(glm::mat3_cast(R_DB)), .origin = root.p_DO};
  for (std::uint32_t part = first; part < first + count; ++part) {
    const PlacedObject placed = objects_.placed_at(part, time);
    const Lean lean = objects_.lean(part, time);
    const auto add = [&](const glm::dvec3& p_O) {
      bounds.add(placed.p_DO + lean.leaning(placed.R_DO * (placed.scale * p_O)));
    };
    if (count == 1) {
      for (const glm::dvec3& corner : box_corners(bounds_[placed.model])) add(corner);
      continue;
    }
    const TriangleMesh& mesh = objects_.models()[placed.model].model().mesh;
    for (const glm::uvec3& triangle : mesh.triangles)
      for (glm::length_t k = 0; k < 3; ++k) add(glm::dvec3(mesh.vertices_m[triangle[k]]));
  }
  const glm::dvec3 p_DB = root.p_DO + R_DB * (0.5 * (bounds.low + bounds.high));
  return {.instance = instance,
          .time = time,
          .p_DB = p_DB,
          .R_DB = R_DB,
          .size_m = bounds.high - bounds.low,
          .velocity_m_s = objects_.velocity_m_s(first, p_DB, time)};
}

}  // namespace groundray
