#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/height_grid.h"

namespace groundray {

/// How rays are decided. Ranges are the same in both: within 1e-9 * range + 1e-9 m of the reference
/// surface.
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
};

/// What a ray meets first.
struct Hit {
  double range_m =
      std::numeric_limits<double>::infinity();  ///< along the ray; infinite if it meets nothing
  glm::vec3 normal{0};                          ///< of the facet, unit, in D, facing up
  std::uint32_t level = 0;                      ///< index of the level that was hit
  explicit operator bool() const noexcept {
    return range_m < std::numeric_limits<double>::infinity();
  }
};

/// What one level scene is made of: parts of a height grid. Samples shared by two parts are one
/// vertex.
struct Level {
  /// A rectangle of samples without holes, traced as one grid primitive.
  struct Block {
    int column = 0;
    int row = 0;
    int columns = 0;  ///< samples, 2 to 32767
    int rows = 0;
  };
  HeightGrid grid;
  std::vector<Block> blocks;
  std::vector<Facet> facets;  ///< facets outside the blocks
};

/// Traces rays through an ordered list of level scenes: each level in turn, until one is hit. All
/// of Embree is in here. Immutable; any number of threads may trace at once.
class RayTracer {
 public:
  /// @param levels         finest first; a ray must pass them in this order.
  /// @param p_DL           origin of the float frame L that Embree works in, in D; keep it near the
  /// sensors.
  /// @param device_config  passed to rtcNewDevice, for example "max_isa=avx2".
  /// @throws Error if Embree refuses: its message, and what was being built.
  RayTracer(std::vector<Level> levels, const glm::dvec3& p_DL, Tracing tracing,
            const std::string& device_config = "");
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// Finds the first hit of each ray from above. Neighbouring rays should be alike: they are traced
  /// in packets.
  /// @param hits  as many as there are rays.
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const noexcept;

  /// The height grid of a level.
  const HeightGrid& grid(std::uint32_t level) const;

  /// Bytes that Embree holds for the scenes, vertices included.
  std::size_t memory_bytes() const;

  /// Which Embree this is, and how wide its packets are: "Embree 3.13.5, packets of 8".
  std::string description() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the point of the 2048 m lattice nearest to `viewpoint` (D): the origin that L takes for
/// it.
glm::dvec3 float_frame_origin(const glm::dvec3& viewpoint);

}  // namespace groundray
