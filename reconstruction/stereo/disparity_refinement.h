#pragma once

#include "core/image/image.h"

namespace groundray {

/// Disparities from least squares; NaN for none.
struct RefinedDisparity {
  ImageF disparity_px;
  ImageF sd_px;      ///< formal: from the window's residuals and texture
  ImageF explained;  ///< fraction of the window's contrast that the fit explains; 0 for none
};

/// Refines disparities so that windows of both images agree best, up to brightness and contrast.
/// Within a window, disparities form a plane fitted to the starting values; pixels that deviate
/// from it by more than 1 px belong to another object and are ignored.
/// @param start_px  starting values, NaN for none. Results that differ by more than 1 px are
///        rejected.
/// @param window_px  side of the windows, odd; weights decrease towards the boundary.
/// @see Foerstner, Guelch, A fast operator for detection and precise location (1987); Lucas, Kanade
///      (1981): the normal equations; Unser, Splines: a perfect fit for signal and image processing
///      (1999): values between pixels
RefinedDisparity refine(const ImageF& left, const ImageF& right, const ImageF& start_px,
                        int window_px);

}  // namespace groundray
