#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// Returns the frame of the samples whose cells cover `area`. A sample is the centre of its cell;
/// the cells' boundaries are whole multiples of cell_m from D's origin. Rows run from north to
/// south, as in rasters.
/// @throws Error if the area is empty or not bounded, cell_m is not above 0, or there would be more
///         than 2^30 samples along a side.
GridFrame frame_over(const Area& area, double cell_m);

/// Returns the frame of the samples whose cells cover `area`, aligned with `like`: it contains all
/// samples of `like` in the area, and `finer` - 1 others between neighbours of these. Columns and
/// rows run as those of `like`.
/// @param finer  subdivisions of a step, at least 1.
/// @throws Error as frame_over, or if `finer` is below 1.
GridFrame frame_like(const GridFrame& like, const Area& area, int finer = 1);

/// @throws Error naming every fault of a frame: fewer than 2 columns or rows, a step of 0,
///         cells_per_m that is not its inverse, numbers that are not finite.
void refuse_faults(const GridFrame& frame);

/// Origin of a cell's height.
enum class HeightSource : std::uint8_t { None, Lidar, Stereo, Fused, Filled };

/// DEM with the properties of each height: columns with one entry per sample of the frame, in row
/// order. Heights are in D; NaN where there is none.
struct DemLayers {
  GridFrame frame;
  std::vector<float> elevation_m;  ///< height of the ground at the sample
  std::vector<float> variance_m2;  ///< variance of measured heights; NaN elsewhere
  /// Number of points of each kind that the ground was fitted to.
  std::vector<std::uint32_t> lidar;
  std::vector<std::uint32_t> stereo;
  std::vector<float> chi2;  ///< chi² of the fit per degree of freedom; NaN for a single point
  std::vector<std::uint16_t> surfaces;  ///< number of surfaces, one above the other
  std::vector<float> overhang_m;        ///< lowest height that is clear of the ground
  /// Free height below the overhang, from the highest point measured below it; if there is none,
  /// from the greatest height of the surrounding ground within the cell.
  std::vector<float> clearance_m;
  std::vector<HeightSource> source;
  std::vector<float> to_data_m;      ///< distance to the nearest measured sample, in plan
  std::vector<float> fill_sd_m;      ///< sd of filled heights
  std::vector<float> upper_bound_m;  ///< upper bound of the ground, where lines of sight pass
  std::vector<float> slope_rad;      ///< slope of the surface against the horizontal
};

/// Returns layers without any information: no sample has a source, and all else is 0 or NaN.
/// @throws Error if they exceed the available memory.
DemLayers unknown_layers(const GridFrame& frame);

/// Returns 1 for each value that meets a condition, else 0.
template <typename Values, typename Condition>
std::vector<std::uint8_t> marks_of(const Values& values, const Condition& meets) {
  std::vector<std::uint8_t> marks;
  marks.reserve(values.size());
  for (const auto& value : values) marks.push_back(meets(value) ? 1 : 0);
  return marks;
}

/// Returns the distance in plan of each sample of a raster to the nearest sample with data, m: 0 at
/// samples with data, infinite if there are none. Exact except for rounding, for any ratio of the
/// cells' sides. The time is proportional to the number of samples.
/// @param size  columns and rows.
/// @param step_m  step from one sample to the next; components may be negative.
/// @param has_data  0 or 1 for each sample, in row order.
/// @throws Error if the raster is empty, the sizes disagree, or a step is zero or not finite.
/// @see Felzenszwalb, Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8
///      (2012).
std::vector<float> data_distance_m(glm::ivec2 size, glm::dvec2 step_m,
                                   std::span<const std::uint8_t> has_data);

}  // namespace groundray
