#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <limits>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/measured_points.h"
#include "reconstruction/work.h"

namespace groundray {

/// How points become a DEM.
struct FusionOptions {
  double outlier_share = 0.02;  ///< of all points, 0 to 1/2
  /// Surfaces are apart where heights leave a gap wider than this and 3 standard deviations.
  double surface_gap_m = 0.3;
  /// Rise over run. What rises higher within a cell is a wall or a trunk, of which the foot counts.
  double steepest_slope = 2;
  double slope_sd = 1;  ///< rise over run that is to be expected where neighbours do not tell
  /// Samples whose height is known worse than this stay unmeasured.
  double most_sd_m = std::numeric_limits<double>::infinity();
  /// For points, and for the tiles in work: points beyond it go to disk.
  std::size_t memory_bytes = std::size_t{1} << 30U;
  /// Of the temporary file, which no other program sees and which never stays behind; the system's
  /// (TMPDIR) unless named.
  std::filesystem::path folder;
};

/// What became of the points.
struct FusionCounts {
  std::uint64_t points = 0;          ///< that were given
  std::uint64_t outside = 0;         ///< of the frame's cells
  std::uint64_t unusable = 0;        ///< no number for a place or height, or heights beyond 32 km
  std::uint64_t without_ground = 0;  ///< cells whose points do not make ground
  std::uint64_t uncertain = 0;       ///< cells whose ground is known worse than most_sd_m
  std::uint64_t bytes_on_disk = 0;   ///< that the temporary file took
};

/// Fills a block with the next points and returns true; returns false if there are none left.
using PointSource = std::function<bool(MeasuredPoints& block)>;

/// What fusion gives.
struct Fusion {
  DemLayers layers;
  FusionCounts counts;
};

/// A part of a DEM: samples `first` and on, as many as layers.frame has, of the whole frame's.
struct DemTile {
  glm::ivec2 first{0};
  DemLayers layers;
};

/// Fuses the points of any number of scans and stereo pairs into a DEM. A sample's cell reaches
/// half a step from it; the height is that of the ground at the sample itself.
///
/// Points of a cell lie on one surface or several, one above the other, told apart by gaps. One is
/// credible if more points are on it than outliers are likely to be, or if it agrees with the
/// ground around. The lowest credible surface is the ground, the next the overhang. Where ground
/// and a wall or trunk are one surface, its lowest part is the ground; where neighbours tell that
/// its foot is not seen, there is none.
///
/// The 24 cells around are fitted by a surface of the second degree, z = h + a u + b v + p u²/2 +
/// q u v + r v²/2, u and v in cells from the sample, robustly and each term held to 0 as far as it
/// is not known. With the variance e² of these cells about planes and s² about such surfaces (their
/// noise taken off, the mean of 7 x 7 cells), what that surface does not tell of the cell itself
/// has the variances
///     s² of the height, 1.8 (s/e) s² of the slope across a cell, 1.15 s² of p and r
/// besides those of the fit. Where noise hides s², it is as large as it may well be.
///
/// Points are freed of the bend, p f(u) + q u v + r f(v) with f(u) = (|u| + u²) / 4, halfway
/// between smooth ground and a crease at the sample; p and r are those around less twice the cell's
/// crest: 0.8 n / (n + 4) of how high its n points stand above the surface, shrunk by s² against
/// their noise. Then a plane is fitted: from the median by Huber's weights, then Tukey's, in units
/// of the points' sd times 1.4826 of the median residual where that is above 1. Its slope is held
/// to that of the cells around, as far as these know it. A group's points together weigh no more
/// than what they have in common lets them. `variance_m2` counts noise (times misfit, chi² per
/// degree of freedom, where above 1), place in plan times slope, what the points of a group have in
/// common (with the group's share of the weight, not lessened by how many they are), the slope lent
/// and the bend. `to_data_m` is 0 or the distance, infinite if nothing was measured at all;
/// fill_sd_m and upper_bound_m are left NaN.
///
/// A lone point, or two, are no ground unless five of the cells around know its height to a third
/// of surface_gap_m, and they agree. Each is then ground or an outlier (outlier_share, spread over
/// 2 m): height and variance are those of all such choices, weighed by Bayes with the surface
/// around; where all being outliers is the likeliest by half there is no ground. With an
/// outlier_share of 0 all points are ground.
///
/// The result is the same for any number of threads, any blocks, order of the points and memory.
/// No points at all give layers of which nothing is known.
/// @throws Error naming every fault of the frame or the options; the first point of which a
///         standard deviation is no number >= 0, or a group 2^31 or more; columns of different
///         lengths; cells that hold too many points for the memory; a temporary file that cannot be
///         written; layers that would take more than work.most_bytes.
/// @see Huber, Ronchetti, Robust statistics (2009), chapter 7.
Fusion fuse(const PointSource& source, const GridFrame& frame, const FusionOptions& options = {},
            const Work& work = {});

/// As above, for rasters that do not fit into memory: `sink` gets the tiles of the DEM, row by row,
/// by one thread at a time. Their to_data_m is NaN where nothing was measured.
FusionCounts fuse(const PointSource& source, const GridFrame& frame, const FusionOptions& options,
                  const std::function<void(DemTile&&)>& sink, const Work& work = {});

}  // namespace groundray
