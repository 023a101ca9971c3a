#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/image/image.h"
#include "reconstruction/stereo/disparity.h"

namespace groundray {

/// Largest absolute disparity: disparities are stored in 16 bits, times 16.
inline constexpr int farthest_px = 2000;

/// Value of a missing disparity or standard deviation.
inline constexpr float no_disparity = std::numeric_limits<float>::quiet_NaN();

/// Image to search, 1 channel each.
struct SearchedImage {
  Image8 grey;
  Image8 seen;
};

/// Result of semi-global matching: disparities of both images to 1/16 px, NaN for none.
struct SemiGlobalDisparity {
  ImageF left_px;
  ImageF right_px;  ///< at the right image's pixels; also u_left - u_right
};

/// Returns whether an image shows all of a window, judged by its corners, its centre and the middle
/// of its sides, except for parts beyond the image.
bool shows_window(const Image8& seen, int x, int y, int reach);

/// Matches two images of equal size, from each side.
/// @param range  up to farthest_px on either side.
/// @throws Error if that takes more bytes than options.most_bytes.
/// @see Birchfield, Tomasi, A pixel dissimilarity measure that is insensitive to image sampling,
///      PAMI 20 (1998): the costs of OpenCV's StereoSGBM
SemiGlobalDisparity semi_global(const Image8& left, const Image8& right,
                                const DisparityRange& range, const MatchOptions& options);

/// Returns the range of the disparities that two images have in common, searched from -2 px to half
/// the width at a width of at most 320 px; nothing if there are none.
/// @throws Error if that takes more bytes than options.most_bytes.
std::optional<DisparityRange> common_range(const SearchedImage& left, const SearchedImage& right,
                                           const MatchOptions& options);

/// Removes patches of less than `pixels` pixels within which disparities change from pixel to pixel
/// by at most 1 px. @return number of pixels removed.
std::uint64_t remove_speckles(ImageF& disparity_px, int pixels);

/// Returns the left disparities smoothed along the image's edges by weighted least squares, with
/// holes filled. Disparities that the right image does not confirm have no weight.
/// @see Min, Choi, Lu, Ham, Sohn, Do, Fast global image smoothing based on weighted least squares,
///      IEEE Transactions on Image Processing 23 (2014): rows and columns in turn
ImageF smooth_guided(const Image8& left, const SemiGlobalDisparity& found);

/// Disparities from least squares; NaN for none.
struct RefinedDisparity {
  ImageF disparity_px;
  ImageF sd_px;      ///< formal: from the window's residuals and texture
  ImageF bend_px;    ///< sd of the error of a plane where the surface bends within the window
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
