#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "core/appearance/texture.h"
#include "core/geometry/footprint.h"
#include "core/geometry/trajectory.h"
#include "core/model/model.h"
#include "core/tracing/ray_tracer.h"
#include "core/tracing/sway.h"

namespace groundray {

/// A model with its textures, prepared for tracing. Immutable; copies share the data.
class ModelScene {
 public:
  /// @throws Error as check_model, if a texture cannot be read, or with Embree's message if Embree
  ///         fails.
  ModelScene(const RayDevice& device, Model model, Tracing tracing);

  const Model& model() const noexcept;
  /// Bytes held by the model's textures; geometry is counted by RayDevice::memory_bytes().
  std::size_t texture_bytes() const noexcept;

  /// Returns whether an image modulates the colour of the surface of a triangle, or of any.
  bool has_albedo(std::uint32_t triangle) const noexcept;
  bool has_albedo() const noexcept;
  /// Returns the ratio of the surface's colour at a point of a triangle to its mean over the model.
  /// @param p_O  the point, in the model's frame O.
  /// @param patch_O  patch of the surface that the ray covers there, in O.
  Tint tint(std::uint32_t triangle, const glm::dvec3& p_O, const SurfacePatch& patch_O,
            Filtering filtering) const noexcept;
  /// Returns the unit normal for shading a point, in O: interpolated from the vertices, if they
  /// have normals, and modified by the normal map.
  /// @param normal_O  unit normal of the triangle, on the visible side.
  glm::dvec3 shading_normal(std::uint32_t triangle, const glm::dvec3& p_O,
                            const glm::dvec3& normal_O, const SurfacePatch& patch_O,
                            Filtering filtering) const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// A stationary object: the pose of its frame O in D, and its size relative to its model.
struct PlacedObject {
  glm::dvec3 p_DO{0};
  glm::dquat R_DO{1, 0, 0, 0};  ///< unit quaternion
  double scale = 1;             ///< positive
  std::uint32_t model = 0;      ///< index into the tracer's models
};

/// A moving object. It stands still before its trajectory begins and after it ends.
struct MovingObject {
  Trajectory X_DO;
  double scale = 1;
  std::uint32_t model = 0;
  /// Consecutive objects with the same number, other than 0, are parts of one instance.
  std::uint32_t body = 0;
};

/// Consecutive objects: the number of the first, and their count.
struct ObjectRange {
  std::uint32_t first = 1, count = 0;
};

/// Traces rays through objects. Each object is intersected in its own frame O, to which rays are
/// transformed in double, so that ranges are equally accurate far from the origin and near it.
/// Surfaces are two-sided. Among objects at equal range, the first counts, and likewise among
/// triangles; but of coplanar triangles that overlap partially, fast tracing may report any.
/// Immutable; any number of threads may trace concurrently.
class ObjectTracer {
 public:
  /// Constructs a tracer without objects.
  ObjectTracer() = default;
  /// Numbers the objects from 1 in the given order, stationary ones first.
  /// @param sways  empty, or the sway of each model: stationary objects lean about their origin by
  ///         it. Their poses are those without wind.
  /// @throws Error listing objects with a scale that is not positive, a pose that is not finite, or
  ///         a model that does not exist, and objects that reach beyond 1e9 m from the origin; or
  ///         with Embree's message if Embree fails.
  ObjectTracer(const RayDevice& device, std::vector<ModelScene> models,
               std::vector<PlacedObject> placed, std::vector<MovingObject> moving,
               std::vector<Sway> sways = {});

  /// Finds the first object that each ray hits before the range in `hits`; leaves the other hits
  /// unchanged. Neighbouring rays should be similar, as for RayTracer::trace.
  /// @param hits  one for each ray.
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept;

  std::size_t size() const noexcept;  ///< number of objects
  bool any_moves() const noexcept;    ///< true if any object moves or sways
  /// Returns the number, from 1, of the instance that an object is, or is a part of.
  std::uint32_t instance_of(std::uint32_t object) const noexcept;
  /// Returns the objects of which an instance consists.
  /// @param instance  its number, from 1.
  ObjectRange parts_of(std::uint32_t instance) const noexcept;
  /// Returns the object of an instance to which a point of its surface belongs.
  /// @param normal  of the surface there, unit.
  std::uint32_t part_at(std::uint32_t instance, const glm::dvec3& p_DQ, const glm::dvec3& normal,
                        std::chrono::nanoseconds time) const noexcept;
  /// Returns the index, in models(), of an object's model.
  /// @param object  its number, from 1.
  std::uint32_t model_of(std::uint32_t object) const noexcept;
  /// Returns the pose, scale and model of an object at a time.
  /// @param object  its number, from 1.
  PlacedObject placed_at(std::uint32_t object, std::chrono::nanoseconds time) const noexcept;
  /// Returns how a stationary object leans at a time, about its origin.
  /// @param object  its number, from 1.
  Lean lean(std::uint32_t object, std::chrono::nanoseconds time) const noexcept;
  std::span<const ModelScene> models() const noexcept;
  /// Returns a tracer of one instance alone, whose objects are numbered from 1.
  /// @param instance  its number, from 1.
  /// @throws Error with Embree's message if Embree fails.
  ObjectTracer only(std::uint32_t instance) const;
  /// Returns the velocity of a point that is fixed to an object, m/s in D; 0 while the object
  /// stands still.
  /// @param object  its number, from 1.
  /// @param p_DQ    position of the point at `time`.
  glm::dvec3 velocity_m_s(std::uint32_t object, const glm::dvec3& p_DQ,
                          std::chrono::nanoseconds time) const noexcept;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
