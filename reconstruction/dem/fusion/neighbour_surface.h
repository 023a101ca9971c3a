#pragma once

// Private to the library: the ground surface through the cells around one.
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>

#include "reconstruction/dem/fusion/quadric.h"

namespace groundray {

/// Name that denotes no group of points.
inline constexpr std::uint32_t no_group = std::numeric_limits<std::uint32_t>::max();

/// Number of neighbours that is sufficient to contradict a cell's own points.
inline constexpr int enough_neighbours = 5;

/// First guess of a cell's ground.
struct GroundGuess {
  double height_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN for none
  float variance_m2 = 0;
  float across_m2 = 0;  ///< variance of its position in plan, each way, besides the lean
  float lean_x = 0;     ///< displacement in plan per error of height: see MeasuredPoints
  float lean_y = 0;
  float bias_m = 0;                ///< root mean square bias of its points
  std::uint32_t group = no_group;  ///< name of the group that all of them belong to
  float x_m = 0;                   ///< mean position of its points, from its sample
  float y_m = 0;
};

/// Plane h + a x + b y, x and y in metres from a sample.
struct SurfacePlane {
  double height_m = 0;
  double slope_x = 0;
  double slope_y = 0;
};

/// Second differences of heights, in metres for steps of one cell.
struct SurfaceBend {
  double xx = 0, xy = 0, yy = 0;
};

/// First fit to the 24 cells around one.
struct NeighbourSketch {
  int cells = 0;                 ///< number of cells with ground
  std::array<float, 6> terms{};  ///< terms in cells; heights are relative to the first cell
  float plane_m2 = 0;            ///< variance of heights about a plane, without their noise
  float plane_counts = 0;        ///< weight of that: cells in excess of a plane's terms, or fewer
  float rough_m2 = 0;            ///< the same about the second-degree surface; may be negative
  float rough_m4 = 0;            ///< variance of rough_m2
  float freedom = 0;             ///< cells in excess of that surface's terms
};

/// Variance of the surrounding ground about surfaces through 5 x 5 of its cells.
struct GroundScatter {
  double plane_m2 = 0;    ///< about planes
  double quadric_m2 = 0;  ///< about second-degree surfaces
};

/// Ground of a cell as estimated from the cells around it.
struct NeighbourSurface {
  int cells = 0;  ///< number of cells around with ground; if 0, only slopes are set
  SurfacePlane plane;
  SurfaceBend bend;
  /// Variance of the ground about the surface.
  double height_variance_m2 = 0;
  double height_x_m2 = 0, height_y_m2 = 0;  ///< covariance of height and slopes, per metre
  double xx = 0, xy = 0, yy = 0;            ///< covariance of the slopes at the cell
  /// Inverse of the slopes' covariance.
  double information_xx = 0, information_xy = 0, information_yy = 0;
  SurfaceBend bend_variance;  ///< of each, m²
  double within_m2 = 0;       ///< variance of the ground within a cell about a bent plane
  double scatter_m = 0;       ///< sd of these cells' heights about the surface, without noise
  /// Height of the cell's own guess above the surface, reduced according to its noise, and the
  /// factor of this reduction.
  double crest_m = 0, crest_share = 0;
  /// Bias that the surface shares with the group of most of these cells, if any: one standard
  /// deviation, with the sign of the group's bias. Not included in the variances above.
  double bias_m = 0;
  std::uint32_t group = no_group;
};

/// Fits a second-degree surface to the 24 cells around one, robustly: starts with the median slopes
/// between cells that are two or four apart, then uses Cauchy's weights (c = 2.385).
/// @param guess  guess of the cell; its neighbours up to two columns and two rows away must exist.
/// @param stride  distance between rows of guesses.
/// @param slope_sd  expected slope where neighbours give none.
NeighbourSketch sketch_neighbours(const GroundGuess* guess, std::ptrdiff_t stride,
                                  glm::dvec2 step_m, double slope_sd) noexcept;

/// Fits that surface again, with the scatter of the ground in a wider area, and estimates its
/// uncertainty. The cell itself is excluded, so that its errors are independent of its neighbours'.
NeighbourSurface neighbour_surface(const GroundGuess* guess, std::ptrdiff_t stride,
                                   glm::dvec2 step_m, double slope_sd,
                                   const NeighbourSketch& sketch,
                                   const GroundScatter& scatter) noexcept;

/// Returns the height of the ground above its tangent at a sample, `places` cells away, per unit of
/// its second difference between cells: halfway between smooth ground, places² / 2, and a crease at
/// the sample, |places| / 2.
template <typename Number>
Number curvature_profile(const Number& places) noexcept {
  const Number size = places < Number{} ? -places : places;
  return 0.25F * size * (1 + size);
}

}  // namespace groundray
