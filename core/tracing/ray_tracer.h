#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/tracing/ground_facet.h"
#include "core/tracing/level.h"
#include "core/tracing/ray.h"

namespace groundray {

/// Embree device, created once and shared by the scenes made with it.
class RayDevice {
 public:
  /// @param config  passed to rtcNewDevice, for example "max_isa=avx2".
  /// @throws Error if Embree rejects it.
  explicit RayDevice(const std::string& config = "");

  /// Returns the bytes that Embree holds for all existing scenes, vertices included.
  std::size_t memory_bytes() const;

  /// Returns Embree's version and the width of its packets: "Embree 3.13.5, packets of 8".
  std::string description() const;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// A level, prepared for tracing. Immutable; copies share the data.
class LevelScene {
 public:
  /// @param p_DL  origin of Embree's float frame L, in D; should be near the sensors.
  /// @param previous  a scene of the same level of the same DEM, whose parts are reused where the
  ///         leaves are the same; or null.
  /// @throws Error with Embree's message if Embree fails.
  LevelScene(const RayDevice& device, Level level, const glm::dvec3& p_DL, Tracing tracing,
             const LevelScene* previous = nullptr);

  const Level& level() const noexcept;
  const glm::dvec3& p_DL() const noexcept;
  Tracing tracing() const noexcept;
  /// Returns the largest deviation of the leaves, metres.
  float deviation_m() const noexcept;
  std::size_t triangle_count() const noexcept;
  /// Returns the number of leaves that bridge holes of the DEM (see Leaf::bridges).
  std::size_t bridging_leaves() const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Traces rays through nested level scenes that form one surface. Immutable; any number of threads
/// may trace concurrently.
class RayTracer {
 public:
  /// @param levels  finest first, each window inside the next; all with the same frame, L and
  ///         tracing.
  RayTracer(const RayDevice& device, std::vector<LevelScene> levels);
  /// Builds the level scenes from `levels`, on a device of its own.
  RayTracer(std::vector<Level> levels, const glm::dvec3& p_DL, Tracing tracing,
            const std::string& device_config = "");
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// Finds the first hit of each ray from above. Rays that start over the finest window traverse
  /// the levels one after the other; other rays are traced through all levels at once.
  /// @param hits  one for each ray.
  /// @param batch   affects only the speed, not the hits.
  /// @param facets  empty or, in exact tracing, one for each ray: the facet of its hit.
  /// @throws Error, the first time that rays are traced through all levels, for lack of memory.
  void trace(std::span<const Ray> rays, std::span<Hit> hits, Batch batch = Batch::Alike,
             std::span<GroundFacet> facets = {}) const;

  /// Bounds the difference between each range and that on the reference surface, metres along the
  /// ray, for any mode of tracing. The bound is infinite where the reference may be hit much
  /// farther away or not at all: behind a silhouette within the leaves' deviations, over holes that
  /// coarse cells bridge, and for a ray that starts within the deviation of the ground. The bound
  /// of a miss is 0, or infinite if the reference may be hit. Objects do not deviate, but the
  /// reference may hide them. Rays are followed leaf by leaf in double, which takes several times
  /// as long as tracing them.
  /// @param hits      of the same rays, from trace, or of objects in front of these hits.
  /// @param bounds_m  one for each ray.
  void bound_errors(std::span<const Ray> rays, std::span<const Hit> hits,
                    std::span<double> bounds_m) const noexcept;

  std::span<const LevelScene> levels() const noexcept;
  const RayDevice& device() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the point of the 2048 m lattice nearest to `viewpoint`, both in D: the origin of L for
/// this viewpoint.
glm::dvec3 float_frame_origin(const glm::dvec3& viewpoint);

}  // namespace groundray
