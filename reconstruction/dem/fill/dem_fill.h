#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/thin_plate/thin_plate_energy.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Region in which heights may be filled.
enum class FillReach : std::uint8_t {
  Enclosed,   ///< holes that do not touch the raster's edge
  Hull,       ///< convex hull of the measured samples
  Everywhere  ///< up to the raster's edge
};

/// Selection of the holes to fill, and the form of the fill.
struct FillOptions {
  FillReach reach = FillReach::Enclosed;
  /// Largest distance to data, m: holes stay open if any part is farther. None: 50 cells.
  std::optional<double> farthest_m;
  double largest_share = 0.2;  ///< fraction of the raster's samples; larger holes stay open
  std::optional<ThinPlateEnergy> form;  ///< none: the best form for similar holes
};

/// Result for a hole.
enum class HoleFate : std::uint8_t {
  Filled,
  Open,      ///< beyond the reach
  TooFar,    ///< some part is farther from data than the limit
  TooLarge,  ///< its fraction of the raster exceeds the limit
  NoGround,  ///< no measured sample touches it
  Partly     ///< the heights taken over do not cover it
};

/// Connected samples without height, with eight neighbours for each.
struct RasterHole {
  glm::ivec2 first{0};  ///< first column and row
  glm::ivec2 last{0};   ///< last column and row
  std::size_t samples = 0;
  double farthest_m = 0;  ///< largest distance to data; infinite without any
  HoleFate fate = HoleFate::Filled;
  ThinPlateEnergy form;      ///< form of its fill
  std::size_t trial = 0;     ///< index in FilledHeights::trials; of filled holes only
  std::size_t at_bound = 0;  ///< number of samples that lie at their bounds
  bool is_least = true;      ///< false: within its bounds, but possibly far from the minimum
};

/// Hold-out test of one kind of holes: pieces of their shape were hidden elsewhere and filled.
struct TrialReport {
  bool is_shadow = false;  ///< true if lines of sight just clear the ground before the holes
  /// True if the area is above 15 times the square of the largest distance to data.
  bool is_long = false;
  double from_cells = 0, to_cells = 0;  ///< range of that distance: at least, and less than
  ThinPlateEnergy form;                 ///< form with the smallest squared errors
  /// Number of samples compared; 0 if too little ground was known, so that another kind's model is
  /// used.
  std::size_t samples = 0;
  /// Fractions of errors, each half of the trials against the error model of the other; NaN if
  /// these were too few.
  double within_1sd = std::numeric_limits<double>::quiet_NaN();
  double within_2sd = std::numeric_limits<double>::quiet_NaN();
  double widened_by = 1;  ///< factor on sd because these errors were larger
};

/// Heights of a DEM with holes filled.
struct FilledHeights {
  std::vector<float> heights_m;   ///< measured heights unchanged; NaN in open holes
  std::vector<float> sd_m;        ///< sd of filled heights; NaN elsewhere, and if unknown
  std::vector<float> to_data_m;   ///< distance to the nearest measured sample, in plan
  std::vector<RasterHole> holes;  ///< in the order of their first samples
  std::vector<TrialReport> trials;
  std::size_t filled = 0;  ///< number of filled samples
};

/// Fills the holes of a DEM, hole by hole, by the surface that minimises the energy of
/// ThinPlateEnergy subject to the measured samples, which stay unchanged.
///
/// The form and the standard deviation of filled heights are determined for each kind of holes by
/// hold-out tests on known ground. With bounds, the fill is the surface of least energy below them;
/// a measured height above its bound stays. Bounds also reveal holes in the shadow of a crest,
/// which hide ground that falls off. Without bounds, take the sd of shadows 1.3 to 2 times as
/// large.
///
/// Time per filled sample: 1 to 4 us with a thin plate or tension, 2 to 7 us with smoothness, more
/// in large holes, and some five times as much with bounds, or a hundred times and more if they are
/// far below a stiff plate. Memory: 40 bytes per sample, and, per thread and sample of the largest
/// hole, 110 bytes times the binary logarithm of the number of its samples, 200 with smoothness,
/// and up to 2.75 times as much with bounds. Results do not depend on the number of threads.
/// @param heights_m  heights of the frame's samples in row order; NaN for none.
/// @param most_m  upper bound of each sample from lines of sight (see sight_bound), NaN for none;
///        or empty.
/// @throws Error naming every fault of the arguments: sizes that disagree, infinite heights or
///         bounds, no height at all, options out of bounds; or if more memory is needed than `work`
///         allows.
/// @see docs/theory/dem_fill.md
FilledHeights fill_dem(const GridFrame& frame, std::span<const float> heights_m,
                       std::span<const float> most_m, const FillOptions& options,
                       const RunControl& work = {});

/// Returns heights with holes filled from `filled_m` where the options permit it, without form, sd
/// and trials. All holes are reported, including those filled in part only.
/// @param filled_m  heights of all samples; where NaN, the hole stays open.
/// @throws Error as fill_dem.
FilledHeights take_filling(const GridFrame& frame, std::span<const float> heights_m,
                           std::span<const float> filled_m, const FillOptions& options);

/// Adds the variance of the surrounding measured heights to that of filled heights: fill_dem
/// estimates how much the ground deviates from the known heights around it, but takes these as
/// exact. Adds the mean variance of the measured samples at most two rows and columns from the
/// nearest one, weighted by their numbers of points. This includes all of the noise, which fills
/// average in part: where noise prevails, the sum is too large by up to the noise.
///
/// Samples whose fill_sd_m is NaN stay unchanged, and so do all if nothing is measured. The time is
/// proportional to the number of samples; memory is 4 bytes for each.
/// @see Danielsson, Euclidean distance mapping, Computer Graphics and Image Processing 14 (1980).
void add_boundary_variance(DemLayers& layers);

/// Inpainting method of OpenCV.
enum class Inpainting : std::uint8_t {
  Telea,        ///< fast marching (Telea 2004)
  NavierStokes  ///< continuation of lines of equal brightness (Bertalmio and others 2001)
};

/// Returns the heights with missing ones filled by OpenCV's inpainting from samples up to three
/// cells away, for comparison. Heights are scaled to a suitable range meanwhile.
/// @param size  columns and rows.
/// @param heights_m  in row order; NaN for none.
/// @throws Error if the sizes disagree or OpenCV fails.
std::vector<float> fill_by_inpainting(glm::ivec2 size, std::span<const float> heights_m,
                                      Inpainting by);

/// Fills holes of a DEM by meshes: the surrounding ground becomes triangles (split as HeightGrid's
/// cells are), their holes are filled by fill_holes (triangulated, refined, faired), and the result
/// is resampled. It is an alternative to fill_dem, for comparison and for boundaries that are so
/// steep or overhanging that no surface of heights joins them: of several heights at a sample the
/// lowest is used. Ground steeper than one in two on average is flattened to that meanwhile. Gives
/// no sd.
///
/// The time grows at least with the square of the edges of a boundary: see HoleLimits. options.form
/// is not used.
/// @param most_edges  largest number of edges of a boundary; holes with more stay open, with the
///        fate Partly.
/// @throws Error as fill_dem and fill_holes.
FilledHeights fill_dem_by_mesh(const GridFrame& frame, std::span<const float> heights_m,
                               const FillOptions& options, std::size_t most_edges,
                               const RunControl& work = {});

}  // namespace groundray
