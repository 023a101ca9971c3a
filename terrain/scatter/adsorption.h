#pragma once

namespace groundray {

/// Kinetics of random sequential adsorption of equal discs on a plane. Darts hit the plane at
/// random, one after another. Each dart places a disc where it hits, unless the disc would overlap
/// one placed earlier. Amounts are areas per unit area of the plane: `coverage` is the fraction of
/// the plane under discs, the thrown amount the area of the discs of all darts, accepted or not.
/// @see Schaaf, Talbot, Surface exclusion effects in adsorption processes (1989), equation 31.

/// Largest supported coverage. From 0.547 on, no dart is accepted.
constexpr double max_adsorption_coverage = 0.45;

/// Returns the probability that a dart is accepted.
/// @param coverage  0 to max_adsorption_coverage.
double free_share(double coverage) noexcept;

/// Returns the amount to throw that yields a coverage. The coverage actually reached differs from
/// the requested one by at most 2e-4 of it.
/// @param coverage  0 to max_adsorption_coverage.
double thrown_for(double coverage) noexcept;

}  // namespace groundray
