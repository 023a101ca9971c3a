#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/image/image.h"
#include "reconstruction/stereo/pinhole_pair.h"

namespace groundray {

/// Range of disparities to search, in whole pixels: from the farthest to the nearest.
struct DisparityRange {
  int least_px = 0;
  int most_px = 0;

  friend bool operator==(const DisparityRange&, const DisparityRange&) = default;
};

/// Returns the disparities of a range of depths, with one more on each side, up to 2000 px.
/// @param farthest_m  may be infinite.
/// @throws Error unless 0 < nearest_m < farthest_m, and both correspond to less than 2000 px.
DisparityRange disparity_range(const PinholePair& pair, double nearest_m, double farthest_m);

/// Parameters of matching.
struct MatchOptions {
  /// Range to search, at most 2000 px. Without it, the range is determined at a width of at most
  /// 320 px, where disparities up to half the width (and of points beyond infinity, for small
  /// errors of pose) are searched.
  std::optional<DisparityRange> range = {};
  int block_px = 3;            ///< side of the squares whose difference is a cost; odd, 1 to 11
  int step_cost = 8;           ///< cost of a disparity that changes by 1, per pixel of a block
  int jump_cost = 32;          ///< cost of one that changes by more
  int uniqueness_percent = 5;  ///< margin of the best cost below all except its neighbours
  /// Number of directions along which costs are summed: eight take 8 bytes per pixel and disparity.
  enum class Paths { Five, Eight };
  Paths paths = Paths::Eight;
  /// Limit of these bytes, also for finding a range; matching throws Error if it takes more.
  std::size_t most_bytes = std::size_t{4} << 30;
  double left_right_px = 1;  ///< largest difference in the left-right consistency check
  int speckle_px = 100;      ///< least number of pixels of a patch without jumps
  /// Starting values of least squares: the disparities found, or smoothed along the image's edges,
  /// which omits two in five of the mismatches, mostly near edges.
  enum class Smoothing { None, Guided };
  Smoothing smoothing = Smoothing::Guided;
  int window_px = 9;  ///< side of the least-squares window; odd, 5 to 31
  /// The stated standard deviation: the floor, a factor times that of least squares, and a factor
  /// times the error of planes where the surface bends within a window, are added in quadrature.
  /// See docs/theory/reconstruction_stereo.md for their derivation.
  double sd_factor = 1.5;
  double sd_bend_factor = 1;
  double sd_floor_px = 0.1;
  double most_sd_px = 0.4;  ///< less certain disparities are omitted
};

/// Numbers of pixels of the left image without a disparity, by reason.
struct UnmatchedCounts {
  std::uint64_t unseen = 0;        ///< outside the left camera's field
  std::uint64_t ambiguous = 0;     ///< no cost is the least, or outside the right camera's field
  std::uint64_t inconsistent = 0;  ///< fails the consistency check: mostly hidden on the right
  std::uint64_t speckle = 0;       ///< in a patch that is too small
  std::uint64_t unrefined = 0;     ///< least squares end elsewhere, or the window has no texture
  std::uint64_t uncertain = 0;     ///< sd above MatchOptions::most_sd_px
};

/// Disparities of the left image, u_left - u_right. All images have 1 channel.
struct DisparityMap {
  ImageF disparity_px;   ///< NaN for none
  ImageF sd_px;          ///< sd of its noise, NaN for none; no image if unknown
  ImageF confidence;     ///< 0 to 1: fraction of a window's contrast that the right image explains
  DisparityRange range;  ///< range searched; empty (0, 0) if the images have nothing in common
  UnmatchedCounts unmatched;
};

/// Matches the images of a pair: by semi-global matching from both sides, of which consistent
/// disparities are kept, and then by least squares in a window on both original images, which also
/// give the standard deviation.
///
/// Images should be encoded for the eye, 0 to 1; the search clamps to that range and rounds to 255
/// steps. Results do not depend on the number of threads.
/// @throws Error naming every option that is out of bounds, images that differ in size or are
///         empty, or the number of bytes that matching would take.
/// @see docs/theory/reconstruction_stereo.md; Hirschmueller, Stereo processing by semiglobal
///      matching and mutual information, PAMI 30 (2008); Min et al., Fast global image smoothing
///      based on weighted least squares, TIP 23 (2014)
DisparityMap match(const RectifiedImage& left, const RectifiedImage& right,
                   const MatchOptions& options = {});

}  // namespace groundray
