#pragma once

#include <glm/vec3.hpp>
#include <string>

#include "core/height_grid.h"

namespace groundray {

/// A digital elevation model as loaded: its surface in D, and where D lies.
struct Dem {
  HeightGrid grid;
  glm::dvec3 origin_w_m{0};  ///< D's origin in W, the coordinates of the DEM's CRS: whole metres
  std::string crs_wkt;       ///< W's coordinate reference system, WKT2:2019; empty if none is named
  std::string crs_name;      ///< for people: "NAD83 / UTM zone 15N (EPSG:26915)"; "local (no CRS)"
};

}  // namespace groundray
