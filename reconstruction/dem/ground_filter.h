#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/height_grid.h"
#include "reconstruction/work.h"

namespace groundray {

/// What a measured point is of.
enum class GroundClass : std::uint8_t {
  Ground,
  Above,  ///< of a plant, a building, a bridge, a vehicle
  Below   ///< of nothing: an echo that came late
};

/// What is taken for ground. Steep land under dense scans, 10 points and more in a cell, does with
/// a smaller threshold and scaling than these.
struct GroundFilterOptions {
  double cell_m = 1;  ///< the lowest point of each cell is looked at: about the points' spacing
  /// What is steeper stands on the ground, if it is narrower than the widest disc.
  double slope = 0.15;
  double window_radius_m = 18;  ///< of the widest disc: half the width of the largest object
  double threshold_m = 0.5;     ///< how far from level ground its points may be
  double scaling_m = 1.25;      ///< by how much farther for each unit of the ground's slope
  /// The spacing of a net that cuts what is wider than the widest disc, and no wider than four
  /// meshes, into pieces; none if 0. For cities: it cuts hills, too.
  double net_m = 0;
  double pit_slope = 5;  ///< points below all around by more than this, over one cell, are below

  /// For scans from the air, of hills and towns alike.
  static constexpr GroundFilterOptions airborne() { return {}; }
  /// For scans by a robot: trunks, bushes and walls, of dense points near by and few far off.
  static constexpr GroundFilterOptions ground_scan() {
    return {.cell_m = 0.25,
            .slope = 0.3,
            .window_radius_m = 3,
            .threshold_m = 0.15,
            .scaling_m = 0.35,
            .pit_slope = 2};
  }
};

/// How many points and cells became what.
struct GroundCounts {
  std::size_t ground = 0;
  std::size_t above = 0;
  std::size_t below = 0;
  std::size_t cells = 0;         ///< of the raster
  std::size_t empty_cells = 0;   ///< without any point
  std::size_t object_cells = 0;  ///< whose lowest point is above the ground
  std::size_t pit_cells = 0;     ///< whose lowest point is below it
};

/// What the filter tells of the points.
struct GroundPoints {
  std::vector<GroundClass> classes;  ///< of each point
  std::vector<float> height_m;       ///< of each point above `surface`; negative below it
  /// The ground as the filter sees it, to tell what is above it; in cells without ground an
  /// interpolation. A help for telling points apart, no DEM.
  HeightGrid surface{glm::ivec2(2), glm::dvec2(0), glm::dvec2(1), std::vector<float>(4)};
  GroundCounts counts;
};

/// Tells which points are of the ground, the lowest surface that is nowhere steeper than
/// `options.slope` over less than the widest disc: finds the lowest point of each cell, drops
/// those that are pits, opens the surface by wider and wider discs, and marks a cell where one disc
/// more lowers it by more than the slope allows over the disc's radius. The other cells make the
/// ground's surface; a point within threshold + scaling * slope of it is ground. Cells with several
/// surfaces, as under a bridge or a tree, keep all points: see find_overhangs.
///
/// Along the border, ground that rises towards it more steeply than `slope` is lost over as many
/// cells as it is times as steep: give tiles a margin.
///
/// Takes time in proportion to points and to cells times the widest disc's radius in cells. The
/// same answer for any number of threads and for points in any order (of points as low as each
/// other in one cell, the first in x, then in y counts).
/// @param points_m  in D, at least one.
/// @throws Error if there are no points, one is not finite or far from D, an option is out of
/// bounds, or the points spread over more than 64 cells each (and over more than 2.5 million in
/// all, which take 100 MB), or over more than `work.most_bytes` allows.
/// @see Pingel, Clarke, McBride, An improved simple morphological filter for the terrain
/// classification of airborne LIDAR data (2013). Differs from it in how blank cells are filled
/// (see membrane_through), and in that the ground's heights are carried from their points to the
/// cells' middles along the surface, so that slopes do not lie too low.
GroundPoints filter_ground(std::span<const glm::dvec3> points_m,
                           const GroundFilterOptions& options = {}, const Work& work = {});

}  // namespace groundray
