#pragma once

#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/accuracy/accuracy.h"

namespace groundray {

/// A surface that is known as a formula. What it calls must bear several threads at once.
struct TrueSurface {
  /// Returns how far a point is from the surface, metres, 0 or more.
  std::function<double(const glm::dvec3& p)> distance_m;
  /// Returns the surface's normal, of any length, where it is nearest to a point; none if it is not
  /// to be compared.
  std::function<glm::dvec3(const glm::dvec3& p)> normal;
  /// How much distance_m changes at most where a point moves by a metre: 1 for a distance.
  double most_change = 1;
};

/// Returns a sphere, seen from outside. @throws Error if the radius is not positive.
TrueSurface true_sphere(const glm::dvec3& centre_m, double radius_m);

/// Returns the plane through a point. @throws Error if the normal has no direction.
TrueSurface true_plane(const glm::dvec3& point_m, const glm::dvec3& normal);

/// Returns a cylinder without ends, seen from outside.
/// @throws Error if the axis has no direction or the radius is not positive.
TrueSurface true_cylinder(const glm::dvec3& point_m, const glm::dvec3& axis, double radius_m);

/// Returns a surface over the plane x, y. Its distance is the height between, which is never less
/// than the true distance.
/// @param height_m  z over x, y.
/// @param steepest  rise over run that the surface nowhere exceeds.
/// @param gradient  rise over run along x and y, for normals; none for none.
/// @throws Error if `steepest` is not 0 or more.
TrueSurface true_heights(std::function<double(double x_m, double y_m)> height_m, double steepest,
                         std::function<glm::dvec2(double x_m, double y_m)> gradient = {});

/// How far a mesh is from a true surface.
struct TrueDistance {
  double at_least_m = 0, at_most_m = 0;  ///< between which the largest distance lies
  BoundedLength mean, rms;               ///< over the mesh, by area
  std::vector<AreaShare> within;         ///< each tolerance
  AngleSpread turn;                      ///< empty if the surface has no normals
  double area_m2 = 0;                    ///< of the mesh
  std::size_t samples = 0;
};

/// Measures a mesh against a true surface. Bounds follow from the distance changing by no more than
/// the surface says. Where the surface goes on and the mesh ends nothing is seen. The same for any
/// number of threads.
/// @throws Error naming every fault of the mesh; if it has no area; if a tolerance is not positive;
///         if a distance is no number, 0 or more; if `most_change` is not positive.
TrueDistance true_distance(const TriangleMesh& mesh, const TrueSurface& truth,
                           std::span<const double> tolerances_m = {},
                           const ShareFineness& fineness = {});

}  // namespace groundray
