#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>

#include "core/geometry/height_grid.h"
#include "terrain/lod/tile_source.h"
#include "terrain/relief/relief.h"

namespace groundray {

/// Reference surface for queries of single heights, whether or not it is entirely in memory.
class Ground {
 public:
  /// Constructs the surface of a grid in memory.
  Ground(const HeightGrid& grid);  // NOLINT(google-explicit-constructor): a grid is ground
  /// Constructs the surface of the samples that `source` provides on the grid `frame`.
  Ground(std::shared_ptr<const TileSource> source, const GridFrame& frame);
  /// Constructs the surface of a DEM with relief.
  Ground(const Ground& dem, std::shared_ptr<const Relief> relief);

  const GridFrame& frame() const noexcept { return frame_; }

  /// Returns the height of the surface at `p` (D, metres); nothing outside the DEM or in a hole.
  /// @throws Error if samples have to be read and cannot.
  std::optional<double> height_m_at(glm::dvec2 p) const;

  /// Returns the plane of the facet at `p`, over grid coordinates; nothing where there is no
  /// height.
  /// @throws Error as height_m_at.
  std::optional<FacetPlane> facet_at(glm::dvec2 p) const;

 private:
  GridFrame frame_;
  std::function<Cell(int column, int row)> cell_;
};

}  // namespace groundray
