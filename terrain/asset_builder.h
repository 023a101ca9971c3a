#pragma once

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string_view>
#include <utility>

#include "core/model.h"

namespace groundray {

/// Returns a surface that has the name and the colour of a built-in material.
ModelSurface asset_surface(std::string_view material);

/// Returns some unit vector at right angles to a vector that is not 0.
glm::dvec3 any_normal_to(const glm::dvec3& v);

/// A point on the middle line of a tube.
struct TubeRing {
  glm::dvec3 p;
  double radius = 0;
};

/// Puts a model together. Either all of its vertices have a normal and a place in the images, or
/// none has.
class AssetBuilder {
 public:
  /// Returns the surface's number.
  std::uint16_t add_surface(ModelSurface surface);

  std::uint32_t add_vertex(const glm::dvec3& p);
  std::uint32_t add_vertex(const glm::dvec3& p, const glm::dvec3& normal, const glm::dvec2& uv);

  /// Adds a triangle, counter-clockwise as seen from outside.
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint16_t surface);

  /// Adds a closed tube whose cross-section is a regular polygon of mean width 2 radius, so that
  /// as seen from all sides it is on average as wide as the round one (Cauchy). It ends in a point
  /// if the last radius is 0.
  /// @param rings  at least two, all apart.
  void add_tube(std::span<const TubeRing> rings, int sides, std::uint16_t surface);

  /// Adds a closed upright cylinder whose cross-section's corners are on the circle, with sharp
  /// rims.
  void add_cylinder(const glm::dvec3& foot, double height, double radius, int sides,
                    std::uint16_t surface);

  /// Adds a closed body between two polygons of equal count, `low[i]` joined to `high[i]`; both
  /// counter-clockwise as seen from the high one's outer side. They may be concave, and are cut
  /// into triangles by the low one's shape.
  void add_loft(std::span<const glm::dvec3> low, std::span<const glm::dvec3> high,
                std::uint16_t surface);

  /// Multiplies all positions.
  void scale(double factor);
  void move(const glm::dvec3& by);

  /// Gives every vertex the mean of its triangles' normals, by area.
  void smooth();

  const Model& model() const { return model_; }
  Model take() { return std::move(model_); }

 private:
  Model model_;
};

}  // namespace groundray
