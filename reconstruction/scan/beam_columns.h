#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/scan/beam_rows.h"
#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// In which column of a grid each return is.
struct BeamColumns {
  std::vector<std::int64_t> column;  ///< of each return, from 0 to below `count`
  std::vector<float> off;            ///< of each return: how far from its cell's centre, in columns
  std::int64_t count = 0;
  bool is_round = false;
};

/// Takes given numbers as columns. A grid is round if azimuth goes on from its last column to its
/// first. Where rings look aside by the same angle all along, they are shifted by whole columns;
/// but not those of RowOrder::Number, which are lines of an image.
/// @param first, last  the least and greatest number, of those without a return too.
BeamColumns columns_of_numbers(std::span<const std::int32_t> numbers, std::int32_t first,
                               std::int32_t last, const BeamRows& rows,
                               std::span<const double> azimuths_rad, RowOrder order);

/// Takes pulses at equal steps of time as columns, and goes on as columns_of_numbers.
/// @return nothing if times are not at equal steps, or many pulses of a ring have one time.
std::optional<BeamColumns> columns_of_times(std::span<const double> times_s, const BeamRows& rows,
                                            std::span<const double> azimuths_rad, RowOrder order);

/// Takes pulses at equal steps of azimuth as columns. The grid is round if no more than three
/// columns in a row are empty; else it begins after the widest gap.
/// @throws Error if azimuths are not at equal steps.
BeamColumns columns_of_azimuths(const BeamRows& rows, std::span<const double> azimuths_rad);

}  // namespace groundray
