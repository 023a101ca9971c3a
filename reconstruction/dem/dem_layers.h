#pragma once

#include <cstdint>
#include <vector>

#include "core/grid_frame.h"

namespace groundray {

/// Where a cell's height comes from.
enum class HeightSource : std::uint8_t { None, Lidar, Stereo, Fused, Filled };

/// A DEM with what is known of each height: columns of one entry for each sample of the frame, row
/// by row. Heights are in D; NaN where there is none.
struct DemLayers {
  GridFrame frame;
  std::vector<float> elevation_m;    ///< of the ground, at the sample
  std::vector<float> variance_m2;    ///< of measured heights; NaN elsewhere
  std::vector<std::uint32_t> lidar;  ///< how many points each kind gave the ground
  std::vector<std::uint32_t> stereo;
  std::vector<float> chi2;              ///< of the fit, per degree of freedom; NaN for a lone point
  std::vector<std::uint16_t> surfaces;  ///< how many, one above the other
  std::vector<float> overhang_m;        ///< the lowest height of what is clear of the ground
  /// Free height up to the overhang, from the highest of what was measured below it, or where
  /// nothing was from the highest that the ground around comes to within the cell.
  std::vector<float> clearance_m;
  std::vector<HeightSource> source;
  std::vector<float> to_data_m;      ///< to the nearest measured sample, in plan
  std::vector<float> fill_sd_m;      ///< of filled heights
  std::vector<float> upper_bound_m;  ///< lines of sight passed here: the ground is no higher
  std::vector<float> slope_rad;      ///< of the surface, against the horizontal
};

/// Returns layers of which nothing is known: no sample has a source, and all else is 0 or NaN.
DemLayers unknown_layers(const GridFrame& frame);

}  // namespace groundray
