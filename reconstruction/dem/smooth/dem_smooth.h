#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Parameters of smoothing.
struct SmoothOptions {
  /// Standard deviation of second derivatives of the true ground, 1/m; none: estimated from the
  /// heights beyond their noise. Smaller values smooth more.
  std::optional<double> curvature_sd_per_m;
  /// Maximum number of reweighting rounds. Iteration stops earlier if the derivative of the cost by
  /// any height, times half the height's sd, is below 1e-3: the root mean square distance from the
  /// minimum is then less than 1e-3 sds. Near edges, sds that differ by a factor of 10 or more may
  /// take some hundred rounds.
  std::size_t most_rounds = 100;
};

/// Smoothed DEM.
struct SmoothHeights {
  std::vector<float> heights_m;   ///< NaN where nothing was measured
  double curvature_sd_per_m = 0;  ///< the value in use
  std::size_t rounds = 0;
  double last_move_m = 0;  ///< largest change of a height in the last round
};

/// Smooths measured heights as far as their noise allows. The result z minimises
///     sum (z - z0)^2 / variance + 2 sum (sqrt(1 + D2 z^2 / k^2) - 1)
/// over measured samples, and over second derivatives between measured samples only, where k is the
/// curvature sd. The second term (Charbonnier's penalty) grows like |D2 z| where that is large, so
/// that heights at edges move by some sds at most, however high the edges are. Unmeasured samples
/// stay unmeasured and have no influence: pass filled heights as NaN, or their variance as NaN.
/// Heights without variance have no influence either, and are omitted from the result.
///
/// Variances are not updated. Those of measured heights are an upper bound for the noise that is
/// left, but smoothed heights are no longer independent of their neighbours, and are biased towards
/// a smoother surface where the ground is rougher than k.
///
/// Takes some 2 us per measured sample and round, usually for 10 to 15 rounds, and longer for a
/// very small curvature sd. Memory: 640 bytes per sample. Uses one thread; results are always the
/// same.
/// @param heights_m  heights of the frame's samples in row order; NaN for none.
/// @param variance_m2  variance of each height, above 0; NaN where it is not measured.
/// @throws Error naming every fault of the arguments, if more memory is needed than `work` allows,
///         or if a curvature sd too small for the variances leaves no equations to solve.
/// @see Charbonnier, Blanc-Feraud, Aubert, Barlaud, Deterministic edge-preserving regularization in
///      computed imaging, IEEE Trans. Image Processing 6 (1997): reweighted least squares.
SmoothHeights smooth_dem(const GridFrame& frame, std::span<const float> heights_m,
                         std::span<const float> variance_m2, const SmoothOptions& options = {},
                         const RunControl& work = {});

}  // namespace groundray
