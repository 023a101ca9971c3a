#pragma once

#include "apps/golden/compare/images/image_file.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Significance of the differences between two estimates of light.
struct Significance {
  double level = 0.01;      ///< probability that any test of a kind fails for equal light
  double beyond_share = 0;  ///< fraction of single values that may fail nevertheless
};

/// Tests whether two path-traced images estimate the same light, from their layers RGB, StdError
/// and Samples: each value, by Student's t with Welch's degrees of freedom; the mean of each block
/// of 8 x 8 pixels; and the mean of each channel. All tests of a kind together have the
/// significance `level` (Šidák's correction). Tests of single values are insensitive to a small
/// error of the whole image. An image without standard errors counts as exact; if neither has any,
/// nothing is tested.
/// Values that are not finite, or whose standard errors are not, cannot be tested. They fail if
/// only the other's cannot be tested, or if no value can be tested and the images are not equal.
/// Values with a standard error of zero must be equal up to rounding.
/// @param reference, other  equal in size, both with RGB.
/// @see Welch, The generalization of Student's problem, Biometrika 34 (1947); Šidák, Rectangular
///      confidence regions for the means of multivariate normal distributions (1967).
void match_light(const ImageFile& reference, const ImageFile& other,
                 const Significance& significance, Section& into);

}  // namespace groundray::golden
