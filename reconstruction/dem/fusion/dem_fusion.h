#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <limits>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/measured_points.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Parameters of the fusion of points into a DEM.
struct FusionOptions {
  double outlier_share = 0.02;  ///< fraction of all points, 0 to 1/2
  /// Surfaces are separate where heights leave a gap wider than this plus 3 standard deviations.
  double surface_gap_m = 0.3;
  /// Largest rise over run of ground. A surface that rises higher within a cell is a wall or a
  /// trunk, and only its foot is used.
  double steepest_slope = 2;
  double slope_sd = 1;  ///< expected rise over run where neighbours give none
  /// Largest sd of a height; samples with a larger one stay unmeasured.
  double most_sd_m = std::numeric_limits<double>::infinity();
  /// Memory for points and for the tiles in work; further points go to a temporary file.
  std::size_t memory_bytes = std::size_t{1} << 30U;
  /// Folder of the temporary file, which is invisible to other programs and always removed; the
  /// system's (TMPDIR) if empty.
  std::filesystem::path folder;
};

/// Numbers of points and cells by their use.
struct FusionCounts {
  std::uint64_t points = 0;    ///< points received
  std::uint64_t outside = 0;   ///< points outside the frame's cells
  std::uint64_t unusable = 0;  ///< points without a finite position, or with heights beyond 32 km
  std::uint64_t without_ground = 0;  ///< cells whose points form no ground
  std::uint64_t uncertain = 0;       ///< cells whose ground has a larger sd than most_sd_m
  std::uint64_t bytes_on_disk = 0;   ///< total size of the temporary files
};

/// Source of points: fills a block with the next points and returns true; returns false if there
/// are none left.
using PointSource = std::function<bool(MeasuredPoints& block)>;

/// Result of the fusion.
struct Fusion {
  DemLayers layers;
  FusionCounts counts;
};

/// Part of a DEM: samples from `first` on of the whole frame, as many as layers.frame has.
struct DemTile {
  glm::ivec2 first{0};
  DemLayers layers;
};

/// Fuses the points of any number of scans and stereo pairs into a DEM. A sample's cell extends
/// half a step to each side; the height is that of the ground at the sample itself: of the lowest
/// credible surface that the cell's points lie on, fitted robustly. docs/theory/dem.md describes
/// the model, what the variance includes, and cells of one or two points. `to_data_m` is 0 or the
/// distance, infinite if nothing was measured at all; fill_sd_m and upper_bound_m are NaN.
///
/// The result is the same for any number of threads, block sizes, order of the points and memory.
/// Without points, all layers are those of unknown_layers, except for `to_data_m`.
/// @throws Error naming every fault of the frame or the options; the first point with a standard
///         deviation that is no number >= 0, or a group of 2^31 or more; columns of different
///         lengths; cells with too many points for the memory; a temporary file that cannot be
///         written; layers that would take more than work.most_bytes.
/// @see docs/theory/dem.md; Huber, Ronchetti, Robust statistics (2009), chapter 7.
Fusion fuse(const PointSource& source, const GridFrame& frame, const FusionOptions& options = {},
            const RunControl& work = {});

/// Fuses points into rasters that do not fit into memory: `sink` receives the tiles of the DEM in
/// row order, from one thread at a time. Their to_data_m is NaN where nothing was measured.
FusionCounts fuse(const PointSource& source, const GridFrame& frame, const FusionOptions& options,
                  const std::function<void(DemTile&&)>& sink, const RunControl& work = {});

}  // namespace groundray
