#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

/// Row of each return in a grid.
struct BeamRows {
  std::vector<std::int32_t> row;  ///< of each return
  int count = 0;
};

/// Assigns each ring a row, as RowOrder specifies. A ring's elevation is the median of its
/// returns'.
/// @param rings  of each return.
/// @throws Error if there would be more than 1e6 rows.
BeamRows rows_of_rings(std::span<const std::int32_t> rings, std::span<const double> elevations_rad,
                       RowOrder order);

/// Distinguishes beams by elevations that form clusters: gaps between beams are at least four times
/// as wide as any beam or gap within one, and beams have four or more returns on average.
/// @return nothing if elevations form no such clusters.
std::optional<BeamRows> rows_of_elevations(std::span<const double> elevations_rad);

/// Distinguishes beams by the order of the table, if it contains one ring after the other as in
/// KITTI's files: azimuth then completes one turn per ring.
/// @return nothing if it does not, or if elevations within a sector of a ring vary by more than
///         half the spacing of consecutive rings.
/// @see Triess, Peter, Rist, Zöllner, Scan-based semantic segmentation of LiDAR point clouds: an
///      experimental study (2020): unfolding scans by their jumps in azimuth.
std::optional<BeamRows> rows_of_turns(std::span<const double> azimuths_rad,
                                      std::span<const double> elevations_rad);

}  // namespace groundray
