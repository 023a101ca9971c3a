#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/grid_frame.h"

namespace groundray {

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
DemLayers unknown_layers(const GridFrame& frame);

}  // namespace groundray
