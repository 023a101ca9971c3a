#pragma once

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/geometry/pose.h"
#include "core/image/image.h"
#include "core/model/model.h"

namespace groundray {

/// Returns a surface with the name and the colour of a built-in material or of a paint.
ModelSurface asset_surface(std::string_view material);

/// Kind of spray on a foliage card.
enum class SprayKind { Leaves, Needles };

/// Returns the surface of a foliage card: the material `broad_leaf`, or `leaf` for needles, with
/// the image of a spray that grows upward from the middle of the bottom row. The visible pixels
/// have on average the brightness of the material.
ModelSurface spray_surface(SprayKind kind);

/// Returns the fraction of an image that alpha leaves visible; 1 without alpha.
double opaque_share(const Image8& image);

/// Returns the area of the convex hull of points; 0 for fewer than three.
double hull_area(std::vector<glm::dvec2> points);

/// Point on the centre line of a tube, and the tube's radius there.
struct TubeRing {
  glm::dvec3 p;
  double radius = 0;
};

/// Assembles a model. Either all of its vertices have a normal and texture coordinates, or none
/// have.
class AssetBuilder {
 public:
  /// Adds a surface and returns its number.
  std::uint16_t add_surface(ModelSurface surface);

  /// Returns the number of the surface with a name; adds it if there is none.
  std::uint16_t surface(std::string_view name, const glm::vec3& color);

  std::uint32_t add_vertex(const glm::dvec3& p);
  std::uint32_t add_vertex(const glm::dvec3& p, const glm::dvec3& normal, const glm::dvec2& uv);

  /// Adds a triangle, counter-clockwise as seen from outside.
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint16_t surface);

  /// Adds a closed tube. Its cross-section is a regular polygon of mean width 2 radius, so that its
  /// width averaged over all directions equals that of the round tube (Cauchy). The tube ends in a
  /// point if the last radius is 0.
  /// @param rings  at least two, at distinct positions.
  void add_tube(std::span<const TubeRing> rings, int sides, std::uint16_t surface);

  /// Adds a closed upright cylinder with sharp edges. The corners of its polygonal cross-section
  /// lie on the circle.
  void add_cylinder(const glm::dvec3& foot, double height, double radius, int sides,
                    std::uint16_t surface);

  /// Adds a closed body between two polygons with equal numbers of corners; `low[i]` is joined to
  /// `high[i]`. Both are counter-clockwise as seen from the outer side of `high`. They may be
  /// concave; both are triangulated by the shape of `low`.
  void add_loft(std::span<const glm::dvec3> low, std::span<const glm::dvec3> high,
                std::uint16_t surface);

  /// Adds a model that has normals, moved by a pose; surfaces of the same name become one.
  void append(const Model& part, const Pose& pose);

  /// Scales all positions about the origin.
  void scale(double factor);

  /// Sets the normal of every vertex to the area-weighted mean of its triangles' normals.
  void smooth();

  const Model& model() const { return model_; }
  Model take() { return std::move(model_); }

 private:
  Model model_;
};

}  // namespace groundray
