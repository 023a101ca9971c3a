#pragma once

#include <cstddef>
#include <optional>

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

}  // namespace groundray
