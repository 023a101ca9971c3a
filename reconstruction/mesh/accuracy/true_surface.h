#pragma once

#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/accuracy/accuracy.h"

namespace groundray {

/// Surface given by a formula. Its functions must be safe for concurrent calls.
struct TrueSurface {
  /// Returns the distance of a point from the surface, m, 0 or more.
  std::function<double(const glm::dvec3& p)> distance_m;
  /// Returns the surface's normal, of any length, at the position nearest to a point; empty if
  /// normals are not compared.
  std::function<glm::dvec3(const glm::dvec3& p)> normal;
  /// Lipschitz constant of distance_m: 1 for a true distance.
  double most_change = 1;
};

/// Returns a sphere, seen from outside. @throws Error if the radius is not positive.
TrueSurface true_sphere(const glm::dvec3& centre_m, double radius_m);

/// Returns the plane through a point. @throws Error if the normal has no direction.
TrueSurface true_plane(const glm::dvec3& point_m, const glm::dvec3& normal);

/// Returns a cylinder of infinite length, seen from outside.
/// @throws Error if the axis has no direction or the radius is not positive.
TrueSurface true_cylinder(const glm::dvec3& point_m, const glm::dvec3& axis, double radius_m);

/// Returns a surface over the x-y plane. Its distance is the vertical distance, which is never less
/// than the true distance.
/// @param height_m  z at x, y.
/// @param steepest  bound of the surface's slope, rise over run.
/// @param gradient  slope along x and y, for normals; empty for none.
/// @throws Error if `steepest` is not 0 or more.
TrueSurface true_heights(std::function<double(double x_m, double y_m)> height_m, double steepest,
                         std::function<glm::dvec2(double x_m, double y_m)> gradient = {});

/// Distance of a mesh from a true surface.
struct TrueDistance {
  double at_least_m = 0, at_most_m = 0;  ///< bounds of the largest distance
  BoundedLength mean, rms;               ///< area-weighted over the mesh
  std::vector<AreaShare> within;         ///< fraction of the area within each tolerance
  AngleSpread turn;                      ///< empty if the surface has no normals
  double area_m2 = 0;                    ///< of the mesh
  std::size_t samples = 0;
};

/// Measures the distance of a mesh from a true surface. The bounds follow from `most_change`. Parts
/// of the surface beyond the mesh do not contribute. The result does not depend on the number of
/// threads.
/// @throws Error listing every fault of the mesh; if it has no area; if a tolerance is not
///         positive; if a distance is negative or not finite; if `most_change` is not positive.
TrueDistance true_distance(const TriangleMesh& mesh, const TrueSurface& truth,
                           std::span<const double> tolerances_m = {},
                           const ShareFineness& fineness = {});

}  // namespace groundray
