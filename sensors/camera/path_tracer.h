#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/appearance/bsdf.h"
#include "core/sobol.h"
#include "core/tracing/scene.h"
#include "sensors/camera/emitters.h"
#include "sensors/sky/atmosphere.h"
#include "sensors/sky/sky.h"

namespace groundray {

/// Path tracer from the camera. At every surface, next-event estimation samples the sun, a point of
/// an emitter and a direction of the dome, and BSDF sampling continues the path, which may hit an
/// emitter or reach the sky. The sun counts by next-event estimation alone (except for camera
/// rays), a constant dome by BSDF sampling alone; of all other lights both count, weighted by the
/// balance heuristic. Nothing is clamped or filtered: the mean over paths converges to the light of
/// paths of at most `depth` rays. Immutable; any number of threads may use one.
/// @see Veach, Robust Monte Carlo methods for light transport simulation (1997), chapters 8 and 9;
///      docs/theory/camera_light.md
class PathTracer {
 public:
  /// @param scene, sky  must live as long as this.
  /// @param depth  most rays in a path: 1 shows only emitted light, 2 adds direct light, and each
  ///        further ray adds one bounce.
  /// @param air  aerial perspective, or nothing.
  /// @throws Error unless depth is from 1 to 64; as bsdf_in_colour, for any of the materials; or as
  ///         Emitters.
  PathTracer(const Scene& scene, const Sky& sky, int depth,
             const std::optional<AerialPerspective>& air);

  /// Paths to be traced, and buffers of one thread; all but `add` is private to the tracer.
  struct Workspace {
    /// Adds a path.
    /// @param ray  of the camera.
    void add(const Ray& ray, const SobolPairs& numbers) {
      paths.push_back({static_cast<std::uint32_t>(paths.size()), 0, glm::vec3(1), numbers});
      rays.push_back(ray);
    }

    /// Path in progress.
    struct Path {
      std::uint32_t sample;
      // Density of its direction; 0 for camera rays, which light sampling cannot generate.
      float pdf_per_sr;
      glm::vec3 throughput;
      SobolPairs numbers;
    };
    /// Surface that a path hit.
    struct Surface {
      glm::dvec3 shading_normal;
      glm::vec3 tint;
      std::uint32_t path;
      std::uint16_t material;
    };
    /// Contribution of a shadow ray if that is not occluded.
    struct Light {
      std::uint32_t sample;
      glm::vec3 radiance;
    };
    /// Shadow rays to one kind of light, and their contributions.
    struct ShadowQueue {
      std::vector<Ray> rays;
      std::vector<Light> lights;
    };
    std::vector<Path> paths, next_paths;
    std::vector<Ray> rays, next_rays;
    std::vector<Hit> hits, light_hits;
    std::vector<Surface> surfaces, by_material;
    std::vector<std::size_t> ends;  // of each material's surfaces
    ShadowQueue of_sun, of_others;
  };

  /// Traces the added paths, and removes them.
  /// @param radiance  one for each path: radiance that arrives along each ray: linear sRGB, W/(m^2
  /// sr), see
  ///        docs/theory/sky.md.
  /// @param labels  labels of each ray's first hit, as in Scene::truth_of, 0 for the sky; empty if
  ///        they are not requested.
  void trace(Workspace& work, std::span<glm::vec3> radiance,
             std::span<std::uint16_t> labels = {}) const;

 private:
  struct Vertices;
  struct LightSamples;
  glm::vec3 emitted(const Ray& ray, const Hit& hit, Workspace::Path& path) const noexcept;
  glm::dvec3 emitted_by_sky(const glm::dvec3& direction, double pdf_per_sr) const noexcept;
  void find_surfaces(Workspace& work) const;
  void scatter(std::span<const Workspace::Surface> surfaces, Workspace& work) const;
  void sample_direct(Vertices& vertices, Workspace& work) const;
  void sample_emitters(Vertices& vertices, Workspace& work) const;
  enum class Strategies { LightAlone, Both };  // that may find a light: see the balance heuristic
  static void enqueue(const Vertices& vertices, const LightSamples& light, Strategies strategies,
                      Workspace::ShadowQueue& queue);
  void add_light(const Workspace::ShadowQueue& queue, Batch batch, std::span<glm::vec3> radiance,
                 Workspace& work) const;

  const Scene& scene_;
  const Sky& sky_;
  int depth_;
  std::optional<AerialPerspective> air_;
  std::span<const Bsdf> bsdfs_;  // by material
  Emitters emitters_;
};

}  // namespace groundray
