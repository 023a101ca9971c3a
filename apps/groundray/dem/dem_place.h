#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/grid_frame.h"
#include "core/mesh_io.h"
#include "terrain/area.h"
#include "terrain/dem.h"

namespace groundray {

/// A DEM that a new one is held against.
struct NamedDem {
  std::filesystem::path file;
  Dem dem;
};

/// Which samples a DEM is asked to have: those of `like`; or cells of `cell_m`, or else those that
/// continue `truth`'s, as far as points go.
struct PlaceChoice {
  std::optional<double> cell_m;
  std::optional<NamedDem> like;
  std::optional<NamedDem> truth;
  std::optional<Area> area_w;  ///< in W: no sample's cell lies beyond
};

/// Takes over the CRS of `like` or `truth` if the points' files name none.
/// @throws Error if two of the three have different ones.
void agree_on_crs(const PlaceChoice& choice, Georeference& points);

/// Returns the frame of a DEM in the points' D, whose height must be W's.
/// @param points_m  the rectangle that points lie in; need not be known if `like` or `area_w` is.
/// @throws Error as frame_over and frame_like; or if neither a cell nor another DEM is given.
GridFrame choose_frame(const PlaceChoice& choice, const Georeference& georeference,
                       const Area& points_m);

/// Whether choose_frame must know where the points lie.
bool needs_extent(const PlaceChoice& choice);

}  // namespace groundray
