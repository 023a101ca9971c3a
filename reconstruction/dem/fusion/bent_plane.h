#pragma once

// Private to the library: planes with a bend, fitted to the points of a cell, and the scatter of
// the ground about them.
#include <array>
#include <cstddef>
#include <glm/vec2.hpp>

#include "reconstruction/dem/fusion/cell_columns.h"
#include "reconstruction/dem/fusion/float_lanes.h"
#include "reconstruction/dem/fusion/neighbour_surface.h"
#include "reconstruction/dem/fusion/quadric.h"

namespace groundray {

/// Returns the six functions whose sum is a bent plane, at points i to i + lanes - 1 of a cell:
/// 1, u, v, f(u), u v and f(v), with positions u, v in cells from the sample and f the
/// curvature_profile.
inline std::array<FloatLanes, 6> bent_plane_functions(const CellColumns& points, std::size_t i,
                                                      glm::vec2 cells_per_m) noexcept {
  const FloatLanes u = load(&points.x_m[i]) * cells_per_m.x,
                   v = load(&points.y_m[i]) * cells_per_m.y;
  return {all_of(1), u, v, curvature_profile(u), u * v, curvature_profile(v)};
}

/// Bent plane through the points of a cell, relative to a plane.
struct BentPlane {
  QuadricTerms terms{};        ///< factors of the functions, m
  QuadricMatrix covariance{};  ///< of the terms, m²
  double fitted = 0;           ///< number of terms that the points determine, not the neighbours
};

/// Fits a bent plane by least squares with the points' present weights. The neighbours' slopes and
/// their uncertainty constrain its slopes.
/// @param about  plane that the result is relative to.
/// @param bend_m2  variances of the bend about 0: with 0 the result is a plane, to 1e-6 m.
BentPlane fit_bent_plane(const CellColumns& points, const SurfacePlane& about,
                         const NeighbourSurface& neighbours, const SurfaceBend& bend_m2,
                         glm::dvec2 step_m) noexcept;

/// Returns true if at least 32 points have weight, in at least 12 of the cell's 4 x 4 parts: enough
/// to determine its bend.
bool has_points_throughout(const CellColumns& points, glm::dvec2 step_m) noexcept;

/// Returns the variance of the ground about a plane, without the points' noise, from the means of
/// the points in 4 x 4 parts of the cell. These scatter by the noise, whose size the scatter within
/// the parts shows, and by the ground. If noise hides the ground, the result is near `expected_m2`.
/// @param fitted  number of terms that were fitted to the points.
/// @param expected_m2  variance as estimated from the surrounding cells, with a standard deviation
///        of its own size.
/// @see DerSimonian, Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7 (1986),
///      for the estimate of a variance between groups
double scatter_m2(const CellColumns& points, const SurfacePlane& plane, double fitted,
                  double expected_m2, glm::dvec2 step_m) noexcept;

}  // namespace groundray
