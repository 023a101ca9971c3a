#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/materials.h"
#include "core/object_tracer.h"
#include "core/ray_tracer.h"

namespace groundray {

/// What the truth says of a surface besides its shape.
struct SurfaceTruth {
  std::uint16_t label = 0;     ///< semantic class; 0 is "none"
  std::uint32_t instance = 0;  ///< number of the object; 0 is the ground, or nothing
  std::uint16_t material = 0;  ///< index among the scene's
};

/// What is known of all objects of a model.
struct ModelTruth {
  std::uint16_t label = 0;
  std::vector<std::uint16_t> materials;  ///< of each surface of the model, index among the scene's
};

/// The world as sensors see it: everything that rays can meet, and what is known about it.
/// Immutable once built.
struct Scene {
  RayTracer rays;  ///< the ground
  SurfaceTruth terrain;
  Materials materials;  ///< those that the truth names; lidars with light need them
  ObjectTracer objects;
  std::vector<ModelTruth> models;  ///< as many as `objects` has models

  /// Finds what each ray meets first, of ground and objects.
  /// @param hits  as many as there are rays.
  void trace(std::span<const Ray> of, std::span<Hit> hits) const noexcept {
    rays.trace(of, hits);
    objects.trace(of, hits);
  }

  /// What is known of the surface that a ray met.
  SurfaceTruth truth_of(const Hit& hit) const noexcept {
    if (hit.object == 0) return terrain;
    const std::uint32_t model = objects.model_of(hit.object);
    const std::uint16_t surface = objects.models()[model].model().surface_of[hit.part];
    return {models[model].label, hit.object, models[model].materials[surface]};
  }
};

}  // namespace groundray
