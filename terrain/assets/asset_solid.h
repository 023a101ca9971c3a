#pragma once

#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "terrain/assets/asset_builder.h"

namespace groundray {

/// Signed distance to a solid's surface at a point, negative inside. It may be smaller than the
/// distance, but not larger, and its zeros are exact.
/// @see Hart, Sphere tracing (1996): signed distance bounds, their unions and differences.
using Solid = std::function<double(const glm::dvec3&)>;

/// Returns the distance to a body of revolution between two spheres, each given by centre and
/// radius.
double round_cone(const glm::dvec3& p, const TubeRing& a, const TubeRing& b);
/// Returns the same, with the radius of each sphere after its centre.
inline double round_cone(const glm::dvec3& p, const glm::dvec3& a, double a_radius,
                         const glm::dvec3& b, double b_radius) {
  return round_cone(p, {a, a_radius}, {b, b_radius});
}

/// Returns the distance to an ellipsoid, to first order near its surface.
double ellipsoid(const glm::dvec3& p, const glm::dvec3& centre, const glm::dvec3& radii);

/// Returns the distance to a box with rounded edges.
double round_box(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high, double radius);

/// Returns the distance to a cylinder along y with rounded edges.
double round_disc(const glm::dvec3& p, const glm::dvec3& centre, double radius, double half_width,
                  double edge);

/// Returns the distance to a simple, counter-clockwise polygon in the plane.
double polygon_distance(const glm::dvec2& p, std::span<const glm::dvec2> corners);

/// Returns the distance to the union of two solids whose joint is filled to about `width`.
double blend(double a, double b, double width);

/// Returns the distance to the intersection of two solids whose common edge is rounded to about
/// `width`.
inline double blend_cut(double a, double b, double width) { return -blend(-a, -b, width); }

/// Box and cell size of a solid's mesh.
struct SolidGrid {
  glm::dvec3 low, high;  ///< contains the solid
  double cell = 0;
};

/// Adds the surface of a solid as closed pieces: a vertex for each piece of surface in a cell,
/// moved onto the surface.
/// @see Gibson, Constrained elastic surface nets (1998); Nielson, Dual marching cubes (2004): the
///      pieces of surface in a cell.
void add_solid(AssetBuilder& builder, const Solid& solid, const SolidGrid& grid,
               std::uint16_t surface);

}  // namespace groundray
