#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/height_grid.h"
#include "core/leaf.h"

namespace groundray {

/// How rays are decided. Ranges are the same in both: within 1e-9 * range + 1e-9 m of the surface
/// that the levels make.
enum class Tracing {
  Fast,   ///< Embree chooses the facet: at most 5e-6 of rays, those that graze a silhouette, may
          ///< choose otherwise
  Exact,  ///< every facet is decided in double
};

/// A ray in D: a point and a unit vector.
struct Ray {
  glm::dvec3 origin{0};
  glm::dvec3 direction{0, 0, -1};
  double far_m = std::numeric_limits<double>::infinity();  ///< hits beyond are none
  std::chrono::nanoseconds time{0};                        ///< when objects that move are met
};

/// What the rays of a batch are like: neighbours are traced in packets.
enum class Batch {
  Alike,         ///< neighbours begin near each other and run side by side
  FromSurfaces,  ///< they run side by side from what rays have met before
  Scattered,     ///< they begin there and run anywhere
};

/// What a ray meets first.
struct Hit {
  double range_m =
      std::numeric_limits<double>::infinity();  ///< along the ray; infinite if it meets nothing
  glm::vec3 normal{0};     ///< of the facet, unit, in D: of the ground up, of an object to the ray
  float deviation_m = 0;   ///< of the leaf: how far it may be from the reference, vertically
  std::uint32_t part = 0;  ///< index of the level that was hit; on an object, of the triangle
  std::uint32_t object = 0;  ///< number of the object that was hit; 0 for the ground
  explicit operator bool() const noexcept {
    return range_m < std::numeric_limits<double>::infinity();
  }
};

/// The part of a terrain that one level scene holds: leaves of its quadtree, and the samples that
/// they stand on. Its window is the rectangle of those samples.
struct Level {
  GridFrame frame;      ///< of the DEM; the same for all levels of a tracer
  HeightArray heights;  ///< every step-th sample of the DEM from `first` on; where the window
                        ///< reaches the DEM's last column or row, that is its last
  glm::ivec2 first{0};  ///< the DEM's sample at heights(0, 0): multiples of step
  int step = 1;         ///< of the finest leaves; a power of two
  int leaf_cells = 8;   ///< side of a leaf in its own cells; a power of two
  /// Side of the parts that are built, and taken over, one by one, in cells of `step`; a power of
  /// two, or 0 for one part.
  int part_cells = 0;
  std::vector<Leaf> leaves;  ///< they tile the window without the next finer level's
};

/// Embree, started once and shared by the scenes made with it.
class RayDevice {
 public:
  /// @param config  passed to rtcNewDevice, for example "max_isa=avx2".
  /// @throws Error if Embree refuses it.
  explicit RayDevice(const std::string& config = "");

  /// Bytes that Embree holds for the scenes that live, vertices included.
  std::size_t memory_bytes() const;

  /// Which Embree this is, and how wide its packets are: "Embree 3.13.5, packets of 8".
  std::string description() const;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// A level, built for tracing. Immutable; copies share it.
class LevelScene {
 public:
  /// @param p_DL  origin of the float frame L that Embree works in, in D; keep it near the sensors.
  /// @param previous  a scene of the same level of the same DEM, of which parts with the same
  /// leaves
  ///                  are taken over; or null.
  /// @throws Error if Embree fails: its message.
  LevelScene(const RayDevice& device, Level level, const glm::dvec3& p_DL, Tracing tracing,
             const LevelScene* previous = nullptr);

  const Level& level() const noexcept;
  const glm::dvec3& p_DL() const noexcept;
  Tracing tracing() const noexcept;
  /// Largest deviation of its leaves, metres.
  float deviation_m() const noexcept;
  std::size_t triangle_count() const noexcept;
  /// Leaves that bridge holes: coarser than the DEM, with some of its samples missing.
  std::size_t bridging_leaves() const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Traces rays through nested level scenes that make one surface. All of Embree is in here.
/// Immutable; any number of threads may trace at once.
class RayTracer {
 public:
  /// @param levels  finest first, each window inside the next; same frame, L and tracing.
  RayTracer(const RayDevice& device, std::vector<LevelScene> levels);
  /// The same, from levels of its own.
  RayTracer(std::vector<Level> levels, const glm::dvec3& p_DL, Tracing tracing,
            const std::string& device_config = "");
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// Finds the first hit of each ray from above. Rays that start over the finest window pass the
  /// levels one after the other; others meet them all at once.
  /// @param hits  as many as there are rays.
  /// @param batch  for speed alone: what is met does not depend on it.
  void trace(std::span<const Ray> rays, std::span<Hit> hits,
             Batch batch = Batch::Alike) const noexcept;

  /// Bounds how far each range may be from that of the reference surface, metres along the ray,
  /// whatever the mode of tracing. Infinite where the reference may be met much further on or
  /// nowhere: past a silhouette within the leaves' deviations, over holes that coarse cells bridge,
  /// and for a ray that starts within the deviation of the ground. The bound of a miss is 0, or
  /// infinite if the reference may be met. An object is where it is, but the reference may hide it.
  /// Rays are followed leaf by leaf in double; that takes some times as long as tracing them.
  /// @param hits      of the same rays, as trace finds them, or an object's in front of that.
  /// @param bounds_m  as many as there are rays.
  void bound_errors(std::span<const Ray> rays, std::span<const Hit> hits,
                    std::span<double> bounds_m) const noexcept;

  std::span<const LevelScene> levels() const noexcept;
  const RayDevice& device() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the point of the 2048 m lattice nearest to `viewpoint` (D): the origin that L takes for
/// it.
glm::dvec3 float_frame_origin(const glm::dvec3& viewpoint);

}  // namespace groundray
