#pragma once

#include <cstddef>
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

/// Number of returns up to which regularity cannot be judged.
inline constexpr std::size_t few_returns = 64;

/// Checks that beams found by their elevations share columns.
/// @throws Error if too few returns have one in the next row.
void check_rows_meet(const OrganisedScan& scan);

/// Checks that the beams of a grid have one orientation: the beams of a cell, of the next column
/// and of the next row turn counter-clockwise everywhere, or clockwise everywhere. Those of a
/// rosette, which rotating prisms draw, do not: the times of its pulses would give a grid with
/// meaningless neighbours. Nor do those of a single beam that moves up and down.
/// @throws Error if more than a quarter turn the other way than most, or if a scan of one row has
///         beams at differing elevations.
void check_beams_turn(const OrganisedScan& scan);

/// Positions of a scan's returns in plan view.
struct PlanPlaces {
  std::span<const double> azimuths_rad;
  std::span<const double> distances_m;  ///< horizontal distance, m
};

/// Returns azimuths as the sensor saw them when each pulse fired, for points that were de-skewed to
/// one stamp while it moved: seen from the position at the stamp, rings that hit near surfaces
/// appear rotated against rings that hit far ones. Estimates the uniform motion in the x-y plane
/// for which the azimuths of each ring grow most evenly with the clock. The sensor's rotation
/// cannot be distinguished from that of its head and is left in.
/// @param clock  of each return, finite: times or column numbers.
/// @return nothing if azimuths are even already, or no motion makes them so.
std::optional<std::vector<double>> azimuths_as_fired(std::span<const double> clock,
                                                     const BeamRows& rows,
                                                     const PlanPlaces& places);

}  // namespace groundray
