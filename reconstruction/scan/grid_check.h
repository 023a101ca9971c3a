#pragma once

#include <cstddef>

#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// Number of returns up to which they tell nothing of regularity.
inline constexpr std::size_t few_returns = 64;

/// Beams that were found by their elevations must look at the same columns.
/// @throws Error if few returns have one in the next row.
void check_rows_meet(const OrganisedScan& scan);

/// Beams of a grid turn one way: from a cell to the next column, and to the next row, is
/// counter-clockwise everywhere or clockwise everywhere. Those of a rosette, which prisms draw, do
/// not: the times of its pulses would make a grid whose neighbours mean nothing. Nor do those of a
/// single beam that wanders up and down.
/// @throws Error if more than a quarter turn the other way than most, or a scan of one row is not
///         of beams at about one elevation.
void check_beams_turn(const OrganisedScan& scan);

}  // namespace groundray
