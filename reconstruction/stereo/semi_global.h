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

/// Returns the left disparities smoothed along the image's edges, with holes filled; unchanged if
/// OpenCV has no ximgproc.
ImageF smooth_guided(const Image8& left, const SemiGlobalDisparity& found,
                     const DisparityRange& range);

}  // namespace groundray
