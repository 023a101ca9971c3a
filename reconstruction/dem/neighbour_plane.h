#pragma once

// Private to the library: the plane through the cells around one.
#include <cstddef>
#include <glm/vec2.hpp>
#include <limits>

namespace groundray {

/// What is known of a cell's ground at first sight.
struct GroundGuess {
  double height_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN for none
  float variance_m2 = 0;
  float x_m = 0;  ///< mean place of its points, from its sample
  float y_m = 0;
};

/// A plane h + a x + b y, x and y in metres from a sample.
struct SurfacePlane {
  double height_m = 0;
  double slope_x = 0;
  double slope_y = 0;
};

/// What the cells around one say of its ground.
struct NeighbourPlane {
  int cells = 0;  ///< how many there are; without any only slopes are told
  SurfacePlane plane;
  double height_variance_m2 = 0;  ///< of the ground there about `plane`, its roughness included
  double scatter_m = 0;           ///< sd of the cells' heights about the plane, noise taken off
  /// Covariance of the slopes at the cell, and its inverse.
  double xx = 0, xy = 0, yy = 0;
  double information_xx = 0, information_xy = 0, information_yy = 0;
};

/// Fits a plane to the 24 cells around one, the cell itself left out, so that it errs apart from
/// it. Robust: begins with the medians of slopes between cells that are two or four apart, then
/// weights by Cauchy's function (c = 2.385) three times.
/// @param guess    of the cell; its neighbours two columns and two rows off must exist.
/// @param stride   of rows of guesses.
/// @param slope_sd  what slopes are like where neighbours do not tell.
NeighbourPlane neighbour_plane(const GroundGuess* guess, std::ptrdiff_t stride, glm::dvec2 step_m,
                               double slope_sd) noexcept;

}  // namespace groundray
