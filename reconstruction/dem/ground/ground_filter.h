#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "core/geometry/height_grid.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Class of a measured point.
enum class GroundClass : std::uint8_t {
  Ground,
  Above,  ///< point on a plant, a building, a bridge, a vehicle
  Below   ///< point on no object: an echo that came late
};

/// Parameters of the ground filter. Steep land in dense scans, with 10 or more points per cell,
/// permits a smaller threshold and scaling than these.
struct GroundFilterOptions {
  double cell_m = 1;  ///< about the points' spacing; the lowest point of each cell is used
  /// Largest slope of the ground, rise over run: steeper features stand on it, if they are narrower
  /// than the widest disc.
  double slope = 0.15;
  double window_radius_m = 18;  ///< radius of the widest disc: half the width of the largest object
  double threshold_m = 0.5;     ///< largest distance of points from level ground
  double scaling_m = 1.25;      ///< increase of that distance per unit of the ground's slope
  /// Spacing of a net that cuts objects wider than the widest disc, and no wider than four meshes,
  /// into pieces; 0 for none. For cities: it cuts hills, too.
  double net_m = 0;
  /// Slope, over one cell, beyond which points below all their neighbours are pits.
  double pit_slope = 5;

  /// Returns the parameters for airborne scans of both hills and towns.
  static constexpr GroundFilterOptions airborne() { return {}; }
  /// Returns the parameters for scans by a robot: trunks, bushes and walls, dense points nearby and
  /// few far away.
  static constexpr GroundFilterOptions ground_scan() {
    return {.cell_m = 0.25,
            .slope = 0.3,
            .window_radius_m = 3,
            .threshold_m = 0.15,
            .scaling_m = 0.35,
            .pit_slope = 2};
  }
};

/// Numbers of points and cells by class.
struct GroundCounts {
  std::size_t ground = 0;
  std::size_t above = 0;
  std::size_t below = 0;
  std::size_t cells = 0;         ///< number of cells of the raster
  std::size_t empty_cells = 0;   ///< cells without points
  std::size_t object_cells = 0;  ///< cells whose lowest point is above the ground
  std::size_t pit_cells = 0;     ///< cells whose lowest point is below the ground
};

/// Result of the ground filter.
struct GroundPoints {
  std::vector<GroundClass> classes;  ///< class of each point
  std::vector<float> height_m;       ///< height of each point above `surface`; negative below it
  /// Ground as estimated by the filter, interpolated in cells without ground. It serves to classify
  /// points and is no DEM.
  HeightGrid surface{glm::ivec2(2), glm::dvec2(0), glm::dvec2(1), std::vector<float>(4)};
  GroundCounts counts;
};

/// Separates the points of the ground, the lowest surface that is nowhere steeper than
/// `options.slope` over less than the widest disc; points within threshold + scaling * slope of it
/// are ground. Cells with several surfaces, as under a bridge or a tree, keep all points: see
/// find_overhangs.
///
/// Ground that rises towards the border more steeply than `slope` is lost there, over as many cells
/// as the ratio of both slopes: give tiles a margin.
///
/// The time is proportional to the number of points, and to cells times the radius of the widest
/// disc in cells. Results do not depend on the number of threads or the order of the points (of
/// equally low points in one cell, the first in x, then in y is used).
/// @param points_m  in D, at least one.
/// @throws Error if there are no points, one is not finite or far from D, an option is out of
///         bounds, or the points are spread over more than 64 cells each (and over more than 2.5
///         million in all, which take 100 MB), or over more than `work.most_bytes` allows.
/// @see Pingel, Clarke, McBride, An improved simple morphological filter for the terrain
///      classification of airborne LIDAR data (2013). Differences: empty cells are filled by
///      membrane_through, and the heights of ground points are carried to the cells' centres along
///      the surface, so that slopes are not too low.
GroundPoints filter_ground(std::span<const glm::dvec3> points_m,
                           const GroundFilterOptions& options = {}, const RunControl& work = {});

/// Surfaces above the ground, for each sample of a frame in row order; a sample's cell extends half
/// a step to each side.
struct Overhangs {
  /// Number of surfaces, one above the other; 0 without points.
  std::vector<std::uint16_t> surfaces;
  /// Height in D of the lowest surface that is clear of the ground; NaN for none.
  std::vector<float> overhang_m;
  /// Free height between that and the highest point of the ground's surface below it; NaN for none.
  /// It differs from overhang_m minus a DEM's height, which is fitted, refers to the sample, and is
  /// filled where an overhang hides the ground.
  std::vector<float> clearance_m;
};

/// Separates the surfaces of each cell: points of one surface leave no gap of more than `gap_m`
/// between their heights above the ground. Features that rise from the ground without such a gap,
/// such as a bush or a trunk, belong to the ground's surface and are no overhangs. In cells without
/// a ground point, clearance is measured from `ground.surface`, and surfaces must be clear of it
/// likewise. Points below the ground or outside the frame are ignored.
/// @param points_m  the points that `ground` was computed from.
/// @throws Error if the numbers of points differ, the frame is invalid or gap_m is not positive.
Overhangs find_overhangs(std::span<const glm::dvec3> points_m, const GroundPoints& ground,
                         const GridFrame& frame, double gap_m);

}  // namespace groundray
