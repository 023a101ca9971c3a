#pragma once

#include <glm/vec3.hpp>
#include <string>

#include "core/geometry/height_grid.h"

namespace groundray {

/// Digital elevation model as loaded: its surface in D, and the position of D.
struct Dem {
  HeightGrid grid;
  glm::dvec3 origin_w_m{0};  ///< D's origin in W, the DEM's CRS: whole metres
  std::string crs_wkt;       ///< CRS of W, WKT2:2019; empty if none is named
  /// Name for human readers: "NAD83 / UTM zone 15N (EPSG:26915)"; "local (no CRS)".
  std::string crs_name;
};

}  // namespace groundray
