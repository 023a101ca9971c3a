#pragma once

#include <cstddef>

namespace groundray::golden {

/// Side of the blocks of pixels whose means are tested in addition to single pixels.
inline constexpr int block_px = 8;

/// Returns the significance level of each of `tests` independent tests for which, without any
/// error, at least one of them fails with probability `level`.
/// @see Šidák, Rectangular confidence regions for the means of multivariate normal distributions,
///      JASA 62 (1967).
double significance_of_one(double level, std::size_t tests);

/// Returns the magnitude that a standard normal variable exceeds in at least one of `tests`
/// independent tests with probability `level`.
double normal_limit(double level, std::size_t tests);

/// As normal_limit, for Student's t.
/// @param freedom  degrees of freedom, at least 1.
double student_limit(double level, std::size_t tests, double freedom);

}  // namespace groundray::golden
