#pragma once

#include <cstddef>

namespace groundray::golden {

/// Pixels along a side of the blocks whose means are tested beside single pixels.
inline constexpr int block_px = 8;

/// Returns the significance of each of so many independent tests that all of them together fail
/// with the chance `level` though nothing is wrong.
/// @see Šidák, Rectangular confidence regions for the means of multivariate normal distributions,
///      JASA 62 (1967).
double significance_of_one(double level, std::size_t tests);

/// Returns the magnitude that a standard normal number exceeds in one of so many tests with the
/// chance `level`.
double normal_limit(double level, std::size_t tests);

/// As normal_limit, of Student's t. @param freedom  its degrees, at least 1.
double student_limit(double level, std::size_t tests, double freedom);

}  // namespace groundray::golden
