#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/image.h"
#include "reconstruction/stereo/disparity.h"

namespace groundray {

/// Disparities are kept in 16 bits, times 16, so they are no farther from 0 than this.
inline constexpr int farthest_px = 2000;

/// Disparity, or its standard deviation, where there is none.
inline constexpr float no_disparity = std::numeric_limits<float>::quiet_NaN();

/// An image to search, 1 channel each.
struct SearchedImage {
  Image8 grey;
  Image8 seen;
};

/// What semi-global matching finds: disparities of both images to 1/16 px, NaN where there is none.
struct SemiGlobalDisparity {
  ImageF left_px;
  ImageF right_px;  ///< of the right image's pixels: u_left - u_right too
};

/// Matches two images of one size, from each side.
/// @param range  up to farthest_px on either side.
/// @throws Error if that takes more bytes than options.most_bytes.
/// @see Birchfield, Tomasi, A pixel dissimilarity measure that is insensitive to image sampling,
///      PAMI 20 (1998): the costs of OpenCV's StereoSGBM
SemiGlobalDisparity semi_global(const Image8& left, const Image8& right,
                                const DisparityRange& range, const MatchOptions& options);

/// Returns the disparities that two images have in common, found at a width of at most 320 px,
/// where those from -2 px to half the width are looked for; nothing if there are none.
/// @throws Error if that takes more bytes than options.most_bytes.
std::optional<DisparityRange> common_range(const SearchedImage& left, const SearchedImage& right,
                                           const MatchOptions& options);

/// Removes patches of less than `pixels` whose disparities differ from pixel to pixel by no more
/// than 1 px. @return how many pixels were removed.
std::uint64_t remove_speckles(ImageF& disparity_px, int pixels);

/// Returns the left disparities smoothed along the image's edges, with holes filled; as found if
/// OpenCV came without ximgproc.
ImageF smooth_guided(const Image8& left, const SemiGlobalDisparity& found,
                     const DisparityRange& range);

}  // namespace groundray
