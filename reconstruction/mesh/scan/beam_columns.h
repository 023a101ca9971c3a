#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/mesh/scan/beam_rows.h"
#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

/// Column of each return in a grid.
struct BeamColumns {
  std::vector<std::int64_t> column;  ///< of each return, from 0 to below `count`
  std::vector<float> off;            ///< of each return: offset from its cell's centre, in columns
  std::int64_t count = 0;
  bool is_round = false;
};

/// Uses given numbers as columns. The grid wraps around (`is_round`) if azimuth continues from its
/// last column to its first. Rings with a constant offset in azimuth are shifted by whole columns,
/// except with RowOrder::Number, whose rings are lines of an image.
/// @param first, last  smallest and largest number, including those without a return.
BeamColumns columns_of_numbers(std::span<const std::int32_t> numbers, std::int32_t first,
                               std::int32_t last, const BeamRows& rows,
                               std::span<const double> azimuths_rad, RowOrder order);

/// Uses pulses at equal steps of time as columns, then proceeds as columns_of_numbers.
/// @return nothing if times are not at equal steps, or many pulses of a ring share one time.
std::optional<BeamColumns> columns_of_times(std::span<const double> times_s, const BeamRows& rows,
                                            std::span<const double> azimuths_rad, RowOrder order);

/// Uses pulses at equal steps of azimuth as columns. The grid wraps around if no more than three
/// consecutive columns are empty; otherwise it begins after the widest gap.
/// @throws Error if azimuths are not at equal steps.
BeamColumns columns_of_azimuths(const BeamRows& rows, std::span<const double> azimuths_rad);

}  // namespace groundray
