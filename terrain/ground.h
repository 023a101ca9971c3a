#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>

#include "core/height_grid.h"
#include "terrain/relief.h"
#include "terrain/tile_source.h"

namespace groundray {

/// The reference surface to be asked for single heights, whether or not it is in memory as a whole.
class Ground {
 public:
  /// Of a grid in memory.
  Ground(const HeightGrid& grid);  // NOLINT(google-explicit-constructor): a grid is ground
  /// Of the samples that `source` serves; `frame` says where they stand.
  Ground(std::shared_ptr<const TileSource> source, const GridFrame& frame);
  /// Of a DEM with relief on it.
  Ground(const Ground& dem, std::shared_ptr<const Relief> relief);

  const GridFrame& frame() const noexcept { return frame_; }

  /// Returns the surface's height below or above `p` (D, metres); nothing outside the DEM or in a
  /// hole. @throws Error if samples have to be read and cannot.
  std::optional<double> height_m_at(glm::dvec2 p) const;

  /// Returns the plane, over grid coordinates, of the facet there; nothing where there is no
  /// height.
  /// @throws Error as height_m_at.
  std::optional<FacetPlane> facet_at(glm::dvec2 p) const;

 private:
  GridFrame frame_;
  std::function<Cell(int column, int row)> cell_;
};

}  // namespace groundray
