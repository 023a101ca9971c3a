#pragma once

#include <array>
#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

namespace groundray {

/// Vehicle with four wheels at the corners of a rectangle and a flat rectangular underbody, both
/// centred on the same point. Lengths in metres.
struct VehicleSize {
  double length_m = 0;        ///< of the underbody, along the heading
  double width_m = 0;         ///< of the underbody
  double wheelbase_m = 0;     ///< between the axles
  double track_m = 0;         ///< between the wheels of an axle
  double clearance_m = 0;     ///< height of the underbody above level ground
  double wheel_radius_m = 0;  ///< of a wheel

  /// Returns the distance in plan from the centre to the farthest corner of underbody or wheels.
  double half_diagonal_m() const noexcept;
};

/// Point of a vehicle in plan, and the height of a grid's surface under it as a weighted sum of
/// three samples.
struct StencilPoint {
  glm::dvec2 p_B{0};  ///< along the heading and to its left, metres
  /// Indices of the samples, relative to that under the vehicle's centre.
  std::array<std::ptrdiff_t, 3> offsets{};
  std::array<double, 3> weights{};  ///< in sum 1

  /// Returns the height of the surface.
  /// @param centre  sample under the vehicle's centre, in an array row by row.
  double height_m(const double* centre) const noexcept {
    return weights[0] * centre[offsets[0]] + weights[1] * centre[offsets[1]] +
           weights[2] * centre[offsets[2]];
  }
};

/// Points under a vehicle whose centre is at a sample of a grid: the grid's surface (two triangles
/// in each cell, as HeightGrid) under the underbody deviates most from a plane at one of them.
struct FootprintStencil {
  std::array<StencilPoint, 4> wheels;  ///< front left, front right, rear left, rear right
  /// All samples within the underbody, its corners, and all crossings of its outline with the edges
  /// of triangles.
  std::vector<StencilPoint> underbody;
  int reach = 0;  ///< largest number of columns or rows between the centre and a used sample
};

/// Returns the points of a vehicle with a heading.
/// @param heading_rad  from east, counter-clockwise.
/// @param cell_m       side of the grid's cells, whose rows run from north to south.
/// @param columns      of the grid: the difference of the indices of successive rows.
FootprintStencil footprint_stencil(const VehicleSize& vehicle, double heading_rad, double cell_m,
                                   int columns);

/// Samples of a disc about a sample.
struct DiscStencil {
  std::vector<std::ptrdiff_t> offsets;  ///< of indices, row by row
  std::vector<glm::dvec2> places_m;     ///< to the east and to the north
  int reach = 0;                        ///< largest number of columns or rows
};

/// Returns the samples whose distance from the centre is at most `radius_m`.
DiscStencil disc_stencil(double radius_m, double cell_m, int columns);

}  // namespace groundray
