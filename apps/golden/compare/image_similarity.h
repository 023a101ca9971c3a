#pragma once

#include "core/image.h"

namespace groundray::golden {

/// Returns the mean structural similarity of two images of one channel: 1 if they are equal.
/// Windows of 11 x 11 pixels with Gaussian weights of 1.5 px, those alone that lie inside and have
/// but finite values; NaN if there is none.
/// @param range  of values, from black to white.
/// @see Wang et al., Image quality assessment: from error visibility to structural similarity, IEEE
///      TIP 13 (2004): k1 = 0.01, k2 = 0.03.
double structural_similarity(const Image<double>& a, const Image<double>& b, double range);

}  // namespace groundray::golden
