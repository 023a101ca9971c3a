#pragma once

#include "core/image/image.h"

namespace groundray::golden {

/// Returns the mean structural similarity (SSIM) of two single-channel images; 1 if they are equal.
/// Averages over all windows of 11 x 11 pixels, with Gaussian weights of sigma 1.5 px, that lie
/// inside the images and have only finite values; NaN if there are none.
/// @param range  difference between the values of white and black.
/// @see Wang et al., Image quality assessment: from error visibility to structural similarity, IEEE
///      TIP 13 (2004): k1 = 0.01, k2 = 0.03.
double structural_similarity(const Image<double>& a, const Image<double>& b, double range);

}  // namespace groundray::golden
