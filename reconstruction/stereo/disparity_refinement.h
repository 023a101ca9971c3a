#pragma once

#include "core/image.h"

namespace groundray {

/// A disparity found by least squares. NaN where there is none.
struct RefinedDisparity {
  ImageF disparity_px;
  ImageF sd_px;      ///< as the window's residuals and texture tell it: formal
  ImageF explained;  ///< share of the window's contrast that the fit explains
};

/// Refines disparities to where windows of both images agree best but for brightness and contrast.
/// Within a window disparity is that of a plane, fitted to those given; pixels that are off it by
/// more than 1 px belong to something else and do not count.
/// @param start_px  NaN where there is none. What ends more than 1 px from it is dropped.
/// @param window_px  side of the windows, odd; weights fall to the rim.
/// @see Foerstner, Gulch, A fast operator for detection and precise location (1987); Lucas, Kanade
///      (1981): the normal equations; Unser, Splines: a perfect fit for signal and image processing
///      (1999): values between pixels
RefinedDisparity refine(const ImageF& left, const ImageF& right, const ImageF& start_px,
                        int window_px);

}  // namespace groundray
