#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/model/model.h"
#include "terrain/assets/asset_builder.h"

namespace groundray {

/// Polygon in space.
using Section = std::vector<glm::dvec3>;

/// Adds a closed body through convex sections with equal numbers of corners, which are
/// counter-clockwise as seen from the side of the last section.
void add_sweep(AssetBuilder& builder, std::span<const Section> sections, std::uint16_t surface);

/// Returns a rectangle in the plane of a constant x, with rounded corners of four points each.
Section round_rectangle(double x, const glm::dvec2& low_yz, const glm::dvec2& high_yz,
                        double radius);

/// Adds a closed box with rounded edges.
void add_block(AssetBuilder& builder, const glm::dvec3& low, const glm::dvec3& high, double radius,
               std::uint16_t surface);

/// Adds a closed pipe along a line. Its corners lie on the circles.
void add_pipe(AssetBuilder& builder, std::span<const TubeRing> rings, int sides,
              std::uint16_t surface);

/// Circle of a body of revolution, and the surface from there to the next circle.
struct LatheRing {
  double along = 0;   ///< on the axis, from the centre
  double radius = 0;  ///< 0 only for the first and the last ring
  std::uint16_t surface = 0;
};

/// Adds a closed body of revolution about an axis through `centre`, parallel to x (0), y (1) or z
/// (2). The profile begins and ends on the axis, with `along` mostly increasing. The ring at
/// `radius` has its corners on the circle, one of them below the centre or, about z, at +x.
void add_lathe(AssetBuilder& builder, const glm::dvec3& centre, int axis,
               std::span<const LatheRing> profile, int sides);

/// Finishes a vehicle: scales it to a length along x, stands its lowest point on the ground, and
/// gives it normals that are creased at 40 degrees.
Model stood(AssetBuilder& builder, double length_m);

/// Gives each corner of a triangle the area-weighted mean normal of the triangles around its vertex
/// that are inclined to it by at most an angle. Vertices at sharper edges are doubled.
Model creased(Model model, double most_rad);

}  // namespace groundray
