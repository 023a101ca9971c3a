#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/bsdf.h"
#include "core/scene.h"
#include "core/sobol.h"
#include "sensors/aerial_perspective.h"
#include "sensors/camera/emitters.h"
#include "sensors/sky.h"

namespace groundray {

/// Light along rays, by paths from the eye. At every surface a path asks for light from the sun, a
/// point of what shines in the scene, and a direction of the dome; where it goes on, it finds light
/// itself. The sun counts by asking alone, a constant dome by finding alone; of all else both
/// count, weighed by the balance heuristic. Nothing is clamped or smoothed: the mean over paths
/// converges to the light of paths of at most `depth` rays. Immutable; any number of threads may
/// use one.
/// @see Veach, Robust Monte Carlo methods for light transport simulation (1997), chapters 8 and 9;
///      docs/camera_light.md
class PathTracer {
 public:
  /// @param scene, sky  must live as long as this.
  /// @param depth  of the longest paths, in rays: 1 sees what shines, 2 what that lights, 3 what is
  ///        lit by that.
  /// @param air  what fades things with distance, or nothing.
  /// @throws Error unless depth is from 1 to 64; as bsdf_in_colour, of any of the materials; or as
  ///         Emitters.
  PathTracer(const Scene& scene, const Sky& sky, int depth,
             const std::optional<AerialPerspective>& air);

  /// A ray of a camera, and the numbers that its path draws.
  struct Sample {
    Ray ray;
    SobolPairs numbers;
  };

  /// Buffers of one thread; what is in them is the tracer's.
  struct Workspace {
    /// A path under way.
    struct Path {
      std::uint32_t sample;
      float pdf_per_sr;  // of its direction; 0 for a camera's, which nothing else could draw
      glm::vec3 throughput;
      SobolPairs numbers;
    };
    /// Light that arrives unless something is in its way.
    struct Light {
      std::uint32_t sample;
      glm::vec3 radiance;
    };
    /// Rays to one kind of light, and what they bring.
    struct Asked {
      std::vector<Ray> rays;
      std::vector<Light> lights;
    };
    std::vector<Path> paths, next_paths;
    std::vector<Ray> rays, next_rays;
    std::vector<Hit> hits, light_hits;
    Asked of_sun, of_others;
  };

  /// Follows one path for each sample.
  /// @param radiance  what arrives along each ray: linear sRGB, W/(m^2 sr), see docs/sky.md.
  /// @param labels  of what each ray meets first, as Scene::truth_of has them, 0 for the sky; empty
  ///        if they are not wanted.
  void trace(std::span<const Sample> samples, std::span<glm::vec3> radiance, Workspace& work,
             std::span<std::uint16_t> labels = {}) const noexcept;

 private:
  struct Vertex;
  glm::vec3 found(const Ray& ray, const Hit& hit, Workspace::Path& path) const noexcept;
  glm::dvec3 found_sky(const glm::dvec3& direction, double pdf_per_sr) const noexcept;
  void scatter(const Ray& ray, const Hit& hit, Workspace::Path path,
               Workspace& work) const noexcept;
  void ask_for_light(const Vertex& vertex, const Bsdf& bsdf, Workspace::Path& path,
                     Workspace& work) const noexcept;
  void add_light(const Workspace::Asked& asked, Batch batch, std::span<glm::vec3> radiance,
                 Workspace& work) const noexcept;

  const Scene& scene_;
  const Sky& sky_;
  int depth_;
  std::optional<AerialPerspective> air_;
  std::span<const Bsdf> bsdfs_;  // by material
  Emitters emitters_;
};

}  // namespace groundray
