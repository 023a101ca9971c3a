#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/geometry/grid_frame.h"
#include "core/io/mesh_io.h"
#include "terrain/dem/dem_io.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// DEM with its file, used as a pattern for another DEM or as its truth.
struct NamedDem {
  std::filesystem::path file;
  Dem dem;
};

/// Choice of a DEM's samples: those of `like`; or cells of `cell_m`; or else the samples of `truth`
/// in the area of the points.
struct PlaceChoice {
  std::optional<double> cell_m;
  std::optional<NamedDem> like;
  std::optional<NamedDem> truth;
  std::optional<Area> area_w;  ///< limits in W of the samples' cells
};

/// Adopts the CRS of `like` or `truth` if the points' files name none.
/// @throws Error if any two of the three CRSs differ.
void agree_on_crs(const PlaceChoice& choice, Georeference& points);

/// Returns the frame of a DEM in the points' D, whose origin must be at height 0 (level_origin).
/// @param points_m  rectangle that contains the points; unused unless needs_extent().
/// @throws Error as frame_over and frame_like; if neither a cell size nor another DEM is given; or
///         if no point lies over `truth`.
GridFrame choose_frame(const PlaceChoice& choice, const Georeference& georeference,
                       const Area& points_m);

/// Returns true if choose_frame needs the extent of the points.
bool needs_extent(const PlaceChoice& choice);

}  // namespace groundray
