#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "reconstruction/dem/fill/dem_fill.h"

namespace CLI {
class App;
}

namespace groundray {

/// Options that select the blank areas of a DEM to be filled.
struct FillLimits {
  FillOptions filling;
  std::optional<std::size_t> most_edges;

  /// Adds the options to a command or option group.
  void add(CLI::App* command);

  /// Largest number of edges of a hole's boundary, for fill_dem_by_mesh.
  std::size_t edges() const { return most_edges.value_or(1000); }
};

/// Statistics of the blank areas with one fate.
struct FateTally {
  HoleFate fate = HoleFate::Filled;
  std::size_t holes = 0, samples = 0;
  double farthest_m = 0;
};

/// Statistics of a DEM's blank areas.
struct FillTally {
  std::vector<FateTally> fates;  ///< fates that occur
  std::size_t at_bound = 0;      ///< number of filled samples limited by their bounds
  std::size_t not_least = 0;     ///< number of holes with bounds whose filling may not be optimal
};

/// Counts blank areas by fate.
FillTally tally_of(const FilledHeights& filled);

/// Prints the fates of blank areas, one per line; nothing if there are none.
void print_fates(const FillTally& tally);

/// Prints the number of holes whose filling below the bounds may not be optimal, unless it is 0.
void print_not_least(const FillTally& tally);

/// Returns the name of a fate in files (docs/reference/formats.md).
const char* word_of(HoleFate fate);

}  // namespace groundray
