#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/grid_frame.h"
#include "reconstruction/dem/plate_form.h"
#include "reconstruction/work.h"

namespace groundray {

/// Where heights may be filled in.
enum class FillReach : std::uint8_t {
  Enclosed,   ///< in holes that do not touch the raster's edge
  Hull,       ///< wherever there are measured samples on all sides: in their convex hull
  Everywhere  ///< up to the raster's edge
};

/// Which holes are filled, and how.
struct FillOptions {
  FillReach reach = FillReach::Enclosed;
  /// A hole stays if some of it is farther from data; none: 50 cells.
  std::optional<double> farthest_m;
  double largest_share = 0.2;     ///< of all samples of the raster; a larger hole stays
  std::optional<PlateForm> form;  ///< none: what proves best for holes alike
};

/// What became of a hole.
enum class HoleFate : std::uint8_t {
  Filled,
  Open,      ///< beyond the reach
  TooFar,    ///< some of it is farther from data than the limit
  TooLarge,  ///< it has a larger share of the raster than the limit
  NoGround,  ///< nothing measured touches it
  Partly     ///< what was taken over does not reach all of it
};

/// Samples without height that touch each other, eight neighbours for each.
struct RasterHole {
  glm::ivec2 first{0};  ///< columns and rows that it spans: from here
  glm::ivec2 last{0};   ///< to here
  std::size_t samples = 0;
  double farthest_m = 0;  ///< from data; infinite without any
  HoleFate fate = HoleFate::Filled;
  PlateForm form;            ///< that it was filled by
  std::size_t trial = 0;     ///< in FilledHeights::trials: of holes alike; only of filled ones
  std::size_t at_bound = 0;  ///< how many of its samples a line of sight holds down
  bool is_least = true;  ///< false: below its bounds, but maybe far from the least; no better found
};

/// How well holes alike can be filled, by pieces of their shape that were hidden elsewhere and
/// filled.
struct TrialReport {
  bool is_shadow = false;  ///< lines of sight just clear the ground before it
  bool is_long = false;    ///< area above 15 times the square of the largest distance to data
  double from_cells = 0, to_cells = 0;  ///< that distance: at least, and less than
  PlateForm form;                       ///< that left the least squares
  std::size_t samples = 0;  ///< tried; 0 if there was no ground to try it, and another kind's serve
  /// Shares of errors: of the trials' one half by the other's law; NaN if they were too few.
  double within_1sd = std::numeric_limits<double>::quiet_NaN();
  double within_2sd = std::numeric_limits<double>::quiet_NaN();
  double widened_by = 1;  ///< what sd was multiplied by because these errors were larger
};

/// A DEM's heights with holes filled.
struct FilledHeights {
  std::vector<float> heights_m;   ///< measured ones as they were; NaN in holes that stay
  std::vector<float> sd_m;        ///< of filled heights; NaN elsewhere, and where nothing tells it
  std::vector<float> to_data_m;   ///< to the nearest measured sample, in plan
  std::vector<RasterHole> holes;  ///< in the order of their first samples
  std::vector<TrialReport> trials;
  std::size_t filled = 0;  ///< samples
};

/// Fills blank areas of a DEM hole by hole with the surface that has the least of what PlateForm
/// tells, given all measured samples, which stay as they are.
///
/// The form is chosen for holes alike (shadows or not, long or compact, and by octaves of the
/// largest distance to data) by trial: pieces of their shape are hidden on known ground near and
/// far, filled by seven forms and compared. The errors of the best tell the sd of filled heights as
/// well, as a power of the distance to data times one of the roughness of the ground about; where
/// the errors of one half of the trials are larger than those of the other tell, sd is widened.
///
/// Under bounds the surface is the one with the least of the same among those below them. A
/// measured height above its bound stays. Holes that lie in the shadow of a crest, as bounds tell,
/// hide ground that falls off: their trials hide what lines of sight as steep would leave in shadow
/// if they came from other sides, and fill it under such bounds.
///
/// On five kinds of terrain 64 to 76 % of errors are within one sd and 91 to 97 % within two.
/// Without bounds nothing tells that holes are shadows: then their sd is to be taken 1.3 to 2 times
/// as large.
///
/// Takes 1 to 4 us for each filled sample with a thin plate or tension and 2 to 7 us with
/// smoothness, for one hole of 1e6 samples 6 and 19 us; some five times as much under bounds, or a
/// hundred times and more if these are far below what a stiff plate would do; and 0.1 s for the
/// trials of each kind of holes (0.2 s under bounds). 40 bytes for each sample, and for each of the
/// largest hole, for each thread, 110 bytes times the binary logarithm of their number, with
/// smoothness 200, and up to 2.75 times as much under bounds: of 1e5 samples 1.7 and 3.0 kB, under
/// bounds 4 and 8 kB. Results do not depend on the number of threads.
/// @param heights_m  of the frame's samples, row by row; NaN where there is none.
/// @param most_m     of each sample the height that a line of sight passes at, NaN for none; or
///                   empty. @see sight_bound
/// @throws Error naming every fault of the arguments: sizes that disagree, infinite heights or
///         bounds, no height at all, options out of bounds; or if more memory is needed than `work`
///         allows.
FilledHeights fill_dem(const GridFrame& frame, std::span<const float> heights_m,
                       std::span<const float> most_m, const FillOptions& options,
                       const Work& work = {});

/// Returns the same with heights that something else has filled in, where options allow it: without
/// form, sd and trials. All holes are told, also those filled in part only.
/// @param filled_m  of each sample; where it is NaN the hole stays.
/// @throws Error as fill_dem.
FilledHeights take_filling(const GridFrame& frame, std::span<const float> heights_m,
                           std::span<const float> filled_m, const FillOptions& options);

}  // namespace groundray
