#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/ground_cover.h"
#include "core/materials.h"
#include "core/object_tracer.h"
#include "core/ray_tracer.h"
#include "core/texture.h"
#include "core/tint.h"

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

/// What a surface shows where a ray meets it: one material or, of ground, several.
struct Appearance {
  /// A material and how much of the surface it is.
  struct Part {
    std::uint16_t material = 0;  ///< index among the scene's
    float share = 1;             ///< of the surface; all parts' are 1
    Tint tint;
  };
  std::array<Part, GroundCover::most_layers> parts;
  std::uint32_t count = 0;
};

/// The world as sensors see it: everything that rays can meet, and what is known about it.
/// Immutable once built.
struct Scene {
  RayTracer rays;        ///< the ground
  SurfaceTruth terrain;  ///< unless `cover` says otherwise
  Materials materials;   ///< those that the truth names; lidars with light need them
  ObjectTracer objects;
  std::vector<ModelTruth> models;  ///< as many as `objects` has models
  GroundCover cover;

  /// Finds what each ray meets first, of ground and objects.
  /// @param hits  as many as there are rays.
  /// @param batch  for speed alone: what is met does not depend on it.
  void trace(std::span<const Ray> of, std::span<Hit> hits,
             Batch batch = Batch::Alike) const noexcept {
    rays.trace(of, hits, batch);
    objects.trace(of, hits);
  }

  /// What is known of the surface that a ray met; of covered ground, the layer with the largest
  /// share at that point.
  SurfaceTruth truth_of(const Ray& ray, const Hit& hit) const noexcept;

  /// Whether all of a material looks the same: there are no textures and no layers.
  bool is_plain() const noexcept;

  /// Returns what the surface shows that a ray met.
  /// @param width_m  of the ray there, for the textures (see surface_patch).
  Appearance appearance_of(const Ray& ray, const Hit& hit, double width_m,
                           Filtering filtering) const noexcept;

  /// Returns the normal to shade with, unit, in D, on the side that the ray comes from. Nothing but
  /// light knows of it: ranges, and the normals of hits, are the facet's.
  /// @param width_m  as above.
  glm::dvec3 shading_normal_of(const Ray& ray, const Hit& hit, double width_m,
                               Filtering filtering) const noexcept;
};

}  // namespace groundray
