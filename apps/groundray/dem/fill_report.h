#pragma once

#include <cstddef>
#include <vector>

#include "reconstruction/dem/dem_fill.h"

namespace groundray {

/// What became of the blank areas of one fate.
struct FateTally {
  HoleFate fate = HoleFate::Filled;
  std::size_t holes = 0, samples = 0;
  double farthest_m = 0;
};

/// What became of a DEM's blank areas.
struct FillTally {
  std::vector<FateTally> fates;  ///< those that there are
  std::vector<TrialReport> trials;
  std::size_t at_bound = 0;   ///< filled samples that bounds hold down
  std::size_t not_least = 0;  ///< holes filled below their bounds, but maybe far from the best
};

/// Returns what became of blank areas, fate by fate.
FillTally tally_of(const FilledHeights& filled);

/// Prints for people what became of blank areas, a line for each fate; nothing if there are none.
void print_fates(const FillTally& tally);

/// Prints for people how many holes are not filled by the best surface below their bounds; nothing
/// if all are.
void print_not_least(const FillTally& tally);

/// Returns a fate's word in files (docs/formats.md).
const char* word_of(HoleFate fate);

}  // namespace groundray
