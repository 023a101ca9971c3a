#pragma once

#include <cstdint>

#include "core/geometry/cell.h"

namespace groundray {

/// Facet of the ground: a half of the cell whose first sample is (column, row) of the DEM.
struct GroundFacet {
  std::uint32_t level = 0;  ///< index of the level that the cell belongs to
  std::int32_t column = 0, row = 0;
  Half half = Half::Near;

  friend bool operator==(const GroundFacet&, const GroundFacet&) = default;
};

}  // namespace groundray
