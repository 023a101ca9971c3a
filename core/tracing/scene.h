#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/appearance/ground_cover.h"
#include "core/appearance/materials.h"
#include "core/appearance/texture.h"
#include "core/tracing/object_tracer.h"
#include "core/tracing/ray_tracer.h"

namespace groundray {

/// Ground truth of a surface besides its shape.
struct SurfaceTruth {
  std::uint16_t label = 0;     ///< semantic class; 0 is "none"
  std::uint32_t instance = 0;  ///< number of the object; 0 is the ground, or nothing
  std::uint16_t material = 0;  ///< index into the scene's materials
};

/// Ground truth common to all objects of a model.
struct ModelTruth {
  std::uint16_t label = 0;
  std::vector<std::uint16_t> materials;  ///< by surface: index into the scene's materials
};

/// Materials of a surface at a hit: one or, on the ground, several.
struct Appearance {
  /// A material and its share of the surface.
  struct Part {
    std::uint16_t material = 0;  ///< index into the scene's materials
    float share = 1;             ///< of the surface; all shares add up to 1
    Tint tint;
  };
  std::array<Part, GroundCover::most_layers> parts;
  std::uint32_t count = 0;
};

/// Materials and shading normal at a hit.
struct SeenSurface {
  Appearance appearance;
  /// Unit, in D, on the side that the ray comes from. It affects light only: ranges and the normals
  /// of hits are those of the facet.
  glm::dvec3 shading_normal;
};

/// The world that sensors observe: everything that rays can hit, and its ground truth. Immutable
/// once built.
struct Scene {
  RayTracer rays;        ///< the ground
  SurfaceTruth terrain;  ///< truth of the ground if `cover` is empty
  Materials materials;  ///< those that the truth refers to; required by lidars with simulated light
  ObjectTracer objects;
  std::vector<ModelTruth> models;  ///< one for each model of `objects`
  GroundCover cover;

  /// Finds the first hit of each ray, on the ground or on an object.
  /// @param hits  one for each ray.
  /// @param batch  affects only the speed, not the hits.
  /// @throws Error as RayTracer::trace.
  void trace(std::span<const Ray> of, std::span<Hit> hits, Batch batch = Batch::Alike) const {
    rays.trace(of, hits, batch);
    objects.trace(of, hits);
  }

  /// Returns the ground truth of the surface that a ray hit; on covered ground, that of the layer
  /// with the largest share at that point.
  SurfaceTruth truth_of(const Ray& ray, const Hit& hit) const noexcept;

  /// Returns whether each material looks the same everywhere: no model has an albedo image and the
  /// ground has no layers.
  bool is_plain() const noexcept;

  /// Returns the materials and tints of the surface that a ray hit.
  /// @param width_m  width of the ray there, for the textures (see surface_patch).
  Appearance appearance_of(const Ray& ray, const Hit& hit, double width_m,
                           Filtering filtering) const noexcept;

  /// Returns the same and the shading normal.
  SeenSurface look_at(const Ray& ray, const Hit& hit, double width_m,
                      Filtering filtering) const noexcept;
};

}  // namespace groundray
