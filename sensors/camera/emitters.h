#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/object_tracer.h"
#include "core/scene.h"

namespace groundray {

/// What shines of a scene itself: the triangles of all objects whose material emits. Points are
/// drawn evenly over each, and each triangle by its share of the sum of area times luminance. So
/// the density per area is a matter of the material alone, wherever its object is.
///
/// Triangles that lie on one another, corner by corner, are one. A surface that images may cut out
/// shines too, but is not drawn. Immutable; any number of threads may use one.
class Emitters {
 public:
  /// @throws Error listing layers of the ground whose material emits, for the ground cannot shine,
  ///         and materials that the scene names but does not have.
  explicit Emitters(const Scene& scene);

  bool any_shines() const noexcept { return any_shines_; }
  bool any_is_drawn() const noexcept { return !sources_.empty(); }

  /// How a surface shines.
  struct Glow {
    glm::dvec3 radiance{0};  ///< the same from both sides; linear sRGB, W/(m^2 sr)
    double pdf_per_m2 = 0;   ///< with which `draw` chooses each point of it; 0 if it does not
  };
  /// Returns that of what a ray met.
  Glow glow_of(const Hit& hit) const noexcept;

  /// A point that was drawn.
  struct Point {
    glm::dvec3 p_DQ;
    glm::dvec3 normal;  ///< of its facet, unit, in D, on any side
    Glow glow;
  };
  /// Draws a point, if any can be.
  /// @param which  uniform in [0, 1)^2: the triangle. @param where  likewise: the point on it.
  /// @param time  when objects that move are met.
  Point draw(const glm::dvec2& which, const glm::dvec2& where,
             std::chrono::nanoseconds time) const noexcept;

 private:
  struct Source {  // an object
    std::uint32_t number;
    double power_until;  // sum of area times luminance, this one's included
  };
  struct Shape {  // the triangles of a model that are drawn, by the object's size 1
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
