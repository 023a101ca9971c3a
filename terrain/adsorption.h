#pragma once

namespace groundray {

/// Kinetics of random sequential adsorption of equal discs on a plane: darts hit the plane at
/// random, one after another, and a disc stays where a dart hits unless it would overlap one that
/// is there already. Amounts are areas: `coverage` is the share of the plane under discs, `thrown`
/// the area of the discs of all darts for each area of the plane.
/// @see Schaaf, Talbot, Surface exclusion effects in adsorption processes (1989), equation 31.

/// Coverages are told up to here. From 0.547 on no dart finds room.
constexpr double max_adsorption_coverage = 0.45;

/// Returns the probability that a dart finds room.
/// @param coverage  0 to max_adsorption_coverage.
double free_share(double coverage) noexcept;

/// Returns what has to be thrown to reach a coverage; the coverage then reached differs from that
/// asked for by at most 2e-4 of it.
/// @param coverage  0 to max_adsorption_coverage.
double thrown_for(double coverage) noexcept;

}  // namespace groundray
