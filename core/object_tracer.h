#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "core/footprint.h"
#include "core/model.h"
#include "core/ray_tracer.h"
#include "core/texture.h"
#include "core/tint.h"
#include "core/trajectory.h"

namespace groundray {

/// A model with its textures, built for tracing. Immutable; copies share it.
class ModelScene {
 public:
  /// @throws Error as check_model, for a texture that cannot be read, or if Embree fails: its
  ///         message.
  ModelScene(const RayDevice& device, Model model, Tracing tracing);

  const Model& model() const noexcept;
  /// Of its textures; the device knows of the rest.
  std::size_t texture_bytes() const noexcept;

  /// Whether an image says how the surface of a triangle, or of any, varies in colour.
  bool has_albedo(std::uint32_t triangle) const noexcept;
  bool has_albedo() const noexcept;
  /// Returns how the surface of a triangle varies at a point of it: from its mean over the model.
  /// @param p_O  in the model's frame. @param patch_O  what is seen of the surface there.
  Tint tint(std::uint32_t triangle, const glm::dvec3& p_O, const SurfacePatch& patch_O,
            Filtering filtering) const noexcept;
  /// Returns the normal to shade a point with, unit, in the model's frame: that of the vertices, if
  /// they have any, and of the normal map on it.
  /// @param normal_O  of the triangle, unit, on the side that is seen.
  glm::dvec3 shading_normal(std::uint32_t triangle, const glm::dvec3& p_O,
                            const glm::dvec3& normal_O, const SurfacePatch& patch_O,
                            Filtering filtering) const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// An object that stands still: where its frame O is in D, and how much larger it is than its
/// model.
struct PlacedObject {
  glm::dvec3 p_DO{0};
  glm::dquat R_DO{1, 0, 0, 0};  ///< unit
  double scale = 1;             ///< positive
  std::uint32_t model = 0;      ///< index among the tracer's models
};

/// An object that moves; before its path begins and after that ends it stands still.
struct MovingObject {
  Trajectory X_DO;
  double scale = 1;
  std::uint32_t model = 0;
};

/// Traces rays through objects. Each is met in its own frame, so that ranges are as good far from
/// the origin as near it: rays enter O in double. Surfaces are two-sided. Of objects that are
/// equally far the first is met, and so of triangles; but of triangles in one plane that overlap in
/// part, fast tracing may meet any.
/// Immutable; any number of threads may trace at once.
class ObjectTracer {
 public:
  /// Nothing to meet.
  ObjectTracer() = default;
  /// Numbers the objects from 1: those that stand first, as they come.
  /// @throws Error listing objects with a scale that is not positive, a pose that is not finite, a
  ///         model that is not there, or one that reaches further than 1e9 m from the origin; or if
  ///         Embree fails: its message.
  ObjectTracer(const RayDevice& device, std::vector<ModelScene> models,
               std::vector<PlacedObject> placed, std::vector<MovingObject> moving);

  /// Finds the first object that each ray meets before what `hits` says; leaves the other hits as
  /// they are. Neighbouring rays should be alike, as for RayTracer::trace.
  /// @param hits  as many as there are rays.
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept;

  std::size_t size() const noexcept;  ///< how many objects there are
  bool any_moves() const noexcept;
  /// The model of an object that was hit, index among the models.
  std::uint32_t model_of(std::uint32_t object) const noexcept;
  /// Where an object is at a time.
  /// @param object  its number, from 1.
  PlacedObject placed_at(std::uint32_t object, std::chrono::nanoseconds time) const noexcept;
  std::span<const ModelScene> models() const noexcept;
  /// Where a point that is fixed to an object moves, m/s in D; 0 for objects that stand.
  /// @param object  its number, from 1.
  /// @param p_DQ    where the point is at `time`.
  glm::dvec3 velocity_m_s(std::uint32_t object, const glm::dvec3& p_DQ,
                          std::chrono::nanoseconds time) const noexcept;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
