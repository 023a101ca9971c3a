#pragma once

#include <cstddef>
#include <optional>

#include "reconstruction/dem/dem_fill.h"

namespace CLI {
class App;
}

namespace groundray {

/// The options that say which blank areas of a DEM are filled.
struct FillLimits {
  FillOptions filling;
  std::optional<std::size_t> most_edges;

  /// Adds them to a command or a group of one.
  void add(CLI::App* command);

  /// Of a rim, for fill_dem_by_mesh.
  std::size_t edges() const { return most_edges.value_or(1000); }
};

}  // namespace groundray
