#pragma once

#include <cstddef>

#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

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

}  // namespace groundray
