#pragma once

// Private to the library: the ground through the cells around one.
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>

#include "reconstruction/dem/quadric.h"

namespace groundray {

/// The name of no group of points.
inline constexpr std::uint32_t no_group = std::numeric_limits<std::uint32_t>::max();

/// Neighbours that are enough to contradict a cell's own points.
inline constexpr int enough_neighbours = 5;

/// What is known of a cell's ground at first sight.
struct GroundGuess {
  double height_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN for none
  float variance_m2 = 0;
  float across_m2 = 0;  ///< variance of its place, each way, but for what goes with its height:
  float lean_x = 0;     ///< see MeasuredPoints
  float lean_y = 0;
  float bias_m = 0;                ///< what its points have in common, if they are
  std::uint32_t group = no_group;  ///< of one group: its name
  float x_m = 0;                   ///< mean place of its points, from its sample
  float y_m = 0;
};

/// A plane h + a x + b y, x and y in metres from a sample.
struct SurfacePlane {
  double height_m = 0;
  double slope_x = 0;
  double slope_y = 0;
};

/// Second differences of heights, in metres for steps of one cell.
struct SurfaceBend {
  double xx = 0, xy = 0, yy = 0;
};

/// What the 24 cells around one look like by themselves.
struct NeighbourSketch {
  int cells = 0;                 ///< how many there are
  std::array<float, 6> terms{};  ///< in cells; heights are above the first of them
  float plane_m2 = 0;            ///< variance of heights about a plane, their noise taken off
  float rough_m2 = 0;  ///< the same about the surface of the second degree; may be negative
  float rough_m4 = 0;  ///< variance of that
  float freedom = 0;   ///< cells more than that surface's terms
};

/// How far the ground around deviates from surfaces through 5 x 5 of its cells: variances.
struct GroundScatter {
  double plane_m2 = 0;    ///< from planes
  double quadric_m2 = 0;  ///< from surfaces of the second degree
};

/// What the cells around one say of its ground.
struct NeighbourSurface {
  int cells = 0;  ///< how many there are; without any only slopes are told
  SurfacePlane plane;
  SurfaceBend bend;
  /// Of the ground about the surface.
  double height_variance_m2 = 0;
  double height_x_m2 = 0, height_y_m2 = 0;  ///< covariance of height and slopes, per metre
  double xx = 0, xy = 0, yy = 0;            ///< covariance of the slopes at the cell
  double information_xx = 0, information_xy = 0, information_yy = 0;  ///< its inverse
  SurfaceBend bend_variance;                                          ///< of each, m²
  double scatter_m = 0;  ///< sd of these cells' heights about the surface, noise taken off
  /// By how much the cell's own guess is above the surface, as far as its noise allows, and which
  /// share of the whole that is.
  double crest_m = 0, crest_share = 0;
  /// What the surface has in common with the group that most of these cells are of, if any: one
  /// standard deviation, of its bias' sign. Not in the variances above.
  double bias_m = 0;
  std::uint32_t group = no_group;
};

/// Fits a surface of the second degree to the 24 cells around one. Robust: begins with the medians
/// of slopes between cells that are two or four apart, then weights by Cauchy's function
/// (c = 2.385).
/// @param guess    of the cell; its neighbours two columns and two rows off must exist.
/// @param stride   of rows of guesses.
/// @param slope_sd  what slopes are like where neighbours do not tell.
NeighbourSketch sketch_neighbours(const GroundGuess* guess, std::ptrdiff_t stride,
                                  glm::dvec2 step_m, double slope_sd) noexcept;

/// Fits that surface once more, with the scatter of the ground in a wider area, and tells how far
/// it is known. The cell itself is left out, so that it errs apart from its neighbours.
NeighbourSurface neighbour_surface(const GroundGuess* guess, std::ptrdiff_t stride,
                                   glm::dvec2 step_m, double slope_sd,
                                   const NeighbourSketch& sketch,
                                   const GroundScatter& scatter) noexcept;

}  // namespace groundray
