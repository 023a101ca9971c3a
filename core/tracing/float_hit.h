#pragma once

// What Embree finds in float: hits, and the facets that they name.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>

#include "core/tracing/embree_adapter.h"
#include "core/tracing/level_scene.h"

namespace groundray {

// Hit that Embree reports for a ray.
struct FloatHit {
  unsigned geometry = RTC_INVALID_GEOMETRY_ID;
  unsigned primitive = 0;
  unsigned instance = RTC_INVALID_GEOMETRY_ID;
  float u = 0, v = 0;
  float range_m = 0;  // from the origin of the float ray
};

// Scene that a packet is traced through: one level, or all levels at once.
struct Target {
  RTCScene scene = nullptr;
  const LevelScene::Impl* level = nullptr;  // the outermost level if is_all
  std::uint32_t number = 0;
  bool is_all = false;
  double min_m = 0, max_m = 0;  // lowest and highest height
  float slack_m = 0;
};

// Traces one ray from a range on.
inline FloatHit intersect_one(const Target& target, const LevelRay& ray, double from_m,
                              const glm::vec3& direction) noexcept {
  RTCRayHit one{};
  one.ray = {ray.origin.x,
             ray.origin.y,
             ray.origin.z,
             static_cast<float>(from_m - ray.enter_m),
             direction.x,
             direction.y,
             direction.z,
             0,
             ray.far_m,
             ~0u,
             0,
             0};
  one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  QueryContext context;
  intersect<1>(target.scene, nullptr, one, context, Coherence::Incoherent);
  return {one.hit.geomID, one.hit.primID, one.hit.instID[0], one.hit.u, one.hit.v, one.ray.tfar};
}

// Returns the facet of a hit.
inline Facet facet_of(const LevelPart& part, const FloatHit& hit) noexcept {
  if (hit.geometry == facet_geometry) return part.triangles[hit.primitive].facet;
  const CellBlock& block = part.blocks[hit.primitive];
  const float u = hit.u * static_cast<float>(block.columns);
  const float v = hit.v * static_cast<float>(block.rows);
  const int column = std::clamp(static_cast<int>(u), 0, block.columns - 1);
  const int row = std::clamp(static_cast<int>(v), 0, block.rows - 1);
  const bool far_half = u - static_cast<float>(column) + (v - static_cast<float>(row)) > 1;
  return {block.column + (column << block.step_exponent), block.row + (row << block.step_exponent),
          block.step_exponent, far_half ? Half::Far : Half::Near, block.deviation_m};
}

// Returns whether the plane of Embree's facet can be intersected directly.
inline bool is_whole(const LevelPart& part, const FloatHit& hit) noexcept {
  return hit.geometry == block_geometry || part.triangles[hit.primitive].whole;
}

// Returns a direction with each component changed by one unit in the last place.
inline glm::vec3 one_ulp_off(const glm::vec3& direction) noexcept {
  constexpr float up = std::numeric_limits<float>::infinity();
  return {std::nextafter(direction.x, up), std::nextafter(direction.y, up),
          std::nextafter(direction.z, up)};
}

}  // namespace groundray
