#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/grid_frame.h"
#include "reconstruction/work.h"

namespace groundray {

/// How a DEM is smoothed.
struct SmoothOptions {
  /// What second derivatives of the true ground are like, their sd in 1/m; none: what the heights
  /// themselves show beyond their noise. Less smooths more.
  std::optional<double> curvature_sd_per_m;
  /// Of reweighting. It ends before where the sum's derivative by any height, times half the
  /// height's sd, is below 1e-3: the root mean square distance to the least is then less than 1e-3
  /// sds. Beside edges sds that differ by 10 times and more may take some hundreds.
  std::size_t most_rounds = 100;
};

/// A smoothed DEM.
struct SmoothHeights {
  std::vector<float> heights_m;   ///< NaN where nothing was measured
  double curvature_sd_per_m = 0;  ///< that was used
  std::size_t rounds = 0;
  double last_move_m = 0;  ///< of any height in the last round
};

/// Smooths measured heights as far as their noise calls for it: the heights z with the least of
///     sum (z - z0)^2 / variance + 2 sum (sqrt(1 + D2 z^2 / k^2) - 1)
/// over measured samples and over second differences between measured samples alone, where k is the
/// curvature sd. The second term grows like |D2 z| where that is large (Charbonnier's penalty), so
/// that edges lose some sds of the heights beside them and no more, however high they are. What was
/// not measured stays so and has no influence: give filled heights as NaN, or their variance as
/// NaN. Heights without variance have no influence either, and are left out.
///
/// Variances are left to the caller as they were: those of measured heights are an upper bound for
/// what noise leaves of smoothed ones, but these are no longer independent of their neighbours, and
/// where the ground is rougher than k tells they are biased towards it.
///
/// Takes some 2 us for each measured sample and round (10 to 15 rounds as a rule), longer where the
/// curvature sd is a small share of what noise makes of curvature: 50 us at 1e-5 of it; and 640
/// bytes for each. One thread; equal results always.
/// @param heights_m    of the frame's samples, row by row; NaN where there is none.
/// @param variance_m2  of each height, above 0; NaN where it is not measured.
/// @throws Error naming every fault of the arguments, if more memory is needed than `work` allows,
///         or if a curvature sd too small for the variances leaves no equations to solve.
/// @see Charbonnier, Blanc-Feraud, Aubert, Barlaud, Deterministic edge-preserving regularization in
///      computed imaging, IEEE Trans. Image Processing 6 (1997): reweighted least squares.
SmoothHeights smooth_dem(const GridFrame& frame, std::span<const float> heights_m,
                         std::span<const float> variance_m2, const SmoothOptions& options = {},
                         const Work& work = {});

}  // namespace groundray
