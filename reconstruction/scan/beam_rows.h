#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// In which row of a grid each return is.
struct BeamRows {
  std::vector<std::int32_t> row;  ///< of each return
  int count = 0;
};

/// Gives each ring a row: see RowOrder. A ring's elevation is the median of its returns'.
/// @param rings  of each return.
/// @throws Error if there would be more than 1e6 rows.
BeamRows rows_of_rings(std::span<const std::int32_t> rings, std::span<const double> elevations_rad,
                       RowOrder order);

/// Tells beams apart by elevations that cluster: gaps between beams are at least four times as
/// wide as any gap or beam between them, and a beam has four returns or more in the mean.
/// @return nothing if elevations do not cluster so.
std::optional<BeamRows> rows_of_elevations(std::span<const double> elevations_rad);

/// Tells beams apart by the order of the table, where one ring follows the other, as in KITTI's
/// files: azimuth runs round once for each ring.
/// @return nothing if it does not, or elevations within a part of such a ring differ by half as
///         much as those of rings that follow each other.
/// @see Triess, Peter, Rist, Zöllner, Scan-based semantic segmentation of LiDAR point clouds: an
///      experimental study (2020): unfolding scans by their jumps in azimuth.
std::optional<BeamRows> rows_of_turns(std::span<const double> azimuths_rad,
                                      std::span<const double> elevations_rad);

}  // namespace groundray
