#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/image.h"
#include "reconstruction/stereo/pinhole_pair.h"
#include "reconstruction/stereo/rectified_image.h"

namespace groundray {

/// Disparities that are looked for, whole pixels: from the farthest to the nearest.
struct DisparityRange {
  int least_px = 0;
  int most_px = 0;

  friend bool operator==(const DisparityRange&, const DisparityRange&) = default;
};

/// Returns the disparities of depths between two, with one more on each side up to 2000 px.
/// @param farthest_m  may be infinite.
/// @throws Error unless 0 < nearest_m < farthest_m, and both are of less than 2000 px.
DisparityRange disparity_range(const PinholePair& pair, double nearest_m, double farthest_m);

/// How two images are matched.
struct MatchOptions {
  /// Without it, what is found at a width of at most 320 px, where disparities up to half the width
  /// (and of points beyond infinity, for small errors of pose) are looked for; 2000 px at most.
  std::optional<DisparityRange> range = {};
  int block_px = 3;            ///< side of the squares whose difference is a cost; odd, 1 to 11
  int step_cost = 8;           ///< of a disparity that changes by 1, for each pixel of a block
  int jump_cost = 32;          ///< of one that changes by more
  int uniqueness_percent = 5;  ///< by how much the best cost must be below all but its neighbours'
  /// Along how many directions costs are summed: eight take 8 bytes for each pixel and disparity.
  enum class Paths { Five, Eight };
  Paths paths = Paths::Eight;
  std::size_t most_bytes = std::size_t{4} << 30;  ///< of these, to find a range too; more: Error
  double left_right_px = 1;  ///< by how much a disparity may differ from the one found back
  int speckle_px = 100;      ///< pixels that a patch without jumps must have
  /// Where least squares start: at what was found, or at that smoothed along the image's edges,
  /// which leaves out two in five of the mismatches, mostly beside edges. What was found if OpenCV
  /// came without ximgproc.
  enum class Smoothing { None, Guided };
  Smoothing smoothing = Smoothing::Guided;
  int window_px = 9;  ///< side of the window of least squares; odd, 5 to 31
  /// The stated standard deviation is that of least squares, times the factor, and the floor, as
  /// squares add: see docs/reconstruction_stereo.md for how they were found.
  double sd_factor = 1.5;
  double sd_floor_px = 0.1;
  double most_sd_px = 0.4;  ///< what is less certain is left out
};

/// Why pixels of the left image have no disparity.
struct UnmatchedCounts {
  std::uint64_t unseen = 0;        ///< the left camera does not look there
  std::uint64_t ambiguous = 0;     ///< no cost is the least, or the right camera looks not there
  std::uint64_t inconsistent = 0;  ///< found back elsewhere: hidden from the right camera, mostly
  std::uint64_t speckle = 0;       ///< in a patch that is too small
  std::uint64_t unrefined = 0;     ///< least squares end elsewhere, or there is too little texture
};

/// The disparities of the left image, u_left - u_right. All images have 1 channel.
struct DisparityMap {
  ImageF disparity_px;   ///< NaN where there is none
  ImageF sd_px;          ///< of its noise, NaN where there is none; no image if that is not known
  ImageF confidence;     ///< 0 to 1: share of a window's contrast that the right image explains
  DisparityRange range;  ///< that was looked through; empty (0, 0) if images have nothing in common
  UnmatchedCounts unmatched;
};

/// Whether Smoothing::Guided is what it says: OpenCV came with ximgproc.
bool has_guided_smoothing() noexcept;

/// Matches the images of a pair: semi-global matching from both sides, of which agree what is kept;
/// then, for each pixel, least squares in a window on both images as they are, along the plane of
/// the disparities round it, but for brightness and contrast. Their normal equations tell how
/// certain it is, with the image's noise, as the residuals show it, taken out of the texture.
///
/// Images should be as encoded for the eye, 0 to 1; the search clamps to that and rounds to 255
/// steps. Results do not depend on the number of threads.
/// @throws Error naming every option that is out of bounds, images that differ in size or are
///         empty, or how many bytes matching would take.
/// @see Hirschmueller, Stereo processing by semiglobal matching and mutual information, PAMI 30
///      (2008); Min et al., Fast global image smoothing based on weighted least squares, TIP 23
///      (2014); Foerstner, Guelch (1987), Lucas, Kanade (1981): least squares
DisparityMap match(const RectifiedImage& left, const RectifiedImage& right,
                   const MatchOptions& options = {});

}  // namespace groundray
