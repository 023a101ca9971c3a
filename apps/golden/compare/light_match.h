#pragma once

#include "apps/golden/compare/image_file.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// When two estimates count as different.
struct Significance {
  double level = 0.01;      ///< chance that a test of a kind fails though the light is the same
  double beyond_share = 0;  ///< of values that may be beyond it nevertheless
};

/// Tests whether two images of paths estimate the same light, from the layers RGB, StdError and
/// Samples: each value, by Student's t with Welch's degrees of freedom, each block of 8 x 8 pixels,
/// and the mean of each channel, all blocks or channels at `level` together (Šidák's correction).
/// Single values alone are blind for what is everywhere a little wrong. An image without standard
/// errors counts as exact; if neither has any, nothing is tested.
/// Values that are not finite, or whose standard errors are not, cannot be tested: they fail if
/// they could be in the reference, or if there are no others and not all are equal. Values without
/// any spread must be equal.
/// @param reference, other  of the same size, both with RGB.
/// @see Welch, The generalization of Student's problem, Biometrika 34 (1947); Šidák, Rectangular
///      confidence regions for the means of multivariate normal distributions (1967).
void match_light(const ImageFile& reference, const ImageFile& other,
                 const Significance& significance, Section& into);

}  // namespace groundray::golden
