#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/tracing/object_tracer.h"
#include "core/tracing/scene.h"

namespace groundray {

/// Emitting surfaces of a scene: the triangles of all objects whose material emits. Triangles are
/// sampled in proportion to area times luminance, and points uniformly on a triangle, so that the
/// density by area depends on the material alone, wherever the object is.
///
/// Triangles with the same three corners act as one. A surface that an image may cut out emits, but
/// is not sampled. Immutable; any number of threads may use one.
/// @see docs/theory/camera_light.md
class Emitters {
 public:
  /// @throws Error listing layers of the ground whose material emits (only objects can), surfaces
  ///         without a material, and materials that the scene names but does not have.
  explicit Emitters(const Scene& scene);

  bool any_shines() const noexcept { return any_shines_; }
  bool any_is_drawn() const noexcept { return !sources_.empty(); }

  /// Emission of a surface.
  struct Glow {
    glm::dvec3 radiance{0};  ///< emitted radiance, equal on both sides; linear sRGB, W/(m^2 sr)
    double pdf_per_m2 = 0;   ///< density with which `draw` samples its points; 0 if it does not
  };
  /// Returns the emission of the surface that a ray hit.
  Glow glow_of(const Hit& hit) const noexcept;

  /// Sampled point.
  struct Point {
    glm::dvec3 p_DQ;
    glm::dvec3 normal;  ///< facet normal, unit, in D, on either side
    Glow glow;
  };
  /// Samples a point; any_is_drawn() must be true.
  /// @param which  uniform in [0, 1)^2: selects object (x) and triangle (y).
  /// @param where  uniform in [0, 1)^2: selects the point on the triangle.
  /// @param time  time of the moving objects' poses.
  Point draw(const glm::dvec2& which, const glm::dvec2& where,
             std::chrono::nanoseconds time) const noexcept;

 private:
  struct Source {  // an object with sampled triangles
    std::uint32_t number;
    double power_until;  // running sum of area times luminance, including this object
  };
  struct Shape {  // sampled triangles of a model, at scale 1
    std::vector<std::uint32_t> triangles;
    std::vector<double> power_until;
  };
  void find_shape(std::size_t model, const std::vector<ModelTruth>& truths,
                  const Materials& materials);

  ObjectTracer objects_;
  bool any_shines_ = false;
  std::vector<std::vector<Glow>> glows_;  // by model and surface
  std::vector<Shape> shapes_;             // by model
  std::vector<Source> sources_;
};

}  // namespace groundray
