#include "apps/groundray/dem/dem_place.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/error.h"
#include "reconstruction/dem/dem_layers.h"
#include "terrain/dem/dem_io.h"

namespace groundray {
namespace {

// Converts a frame from one D to another.
GridFrame moved(GridFrame frame, const glm::dvec3& from_w_m, const glm::dvec3& to_w_m) {
  frame.origin_m += glm::dvec2(from_w_m - to_w_m);
  return frame;
}

void agree(const NamedDem& other, Georeference& points) {
  const Dem& dem = other.dem;
  if (points.crs_wkt.empty() && points.crs_name.empty()) {
    points.crs_wkt = dem.crs_wkt;
    points.crs_name = dem.crs_wkt.empty() ? "" : dem.crs_name;
    return;
  }
  if (dem.crs_wkt.empty()) return;
  const bool is_same = points.crs_wkt.empty() ? points.crs_name == dem.crs_name
                                              : is_same_crs(points.crs_wkt, dem.crs_wkt);
  if (is_same) return;
  throw Error(
      "{}: its CRS is {}, but that of the points is {}: warp it with `gdalwarp -t_srs`, or use the "
      "DEM that the points were measured over",
      other.file.string(), dem.crs_name, points.crs_name);
}

// Enlarges the rectangle slightly, because the outermost points lie on its border.
Area with_border(const Area& area, double by_m) {
  return {area.low_m - glm::dvec2(by_m), area.high_m + glm::dvec2(by_m)};
}

}  // namespace

void agree_on_crs(const PlaceChoice& choice, Georeference& points) {
  if (choice.like) agree(*choice.like, points);
  if (choice.truth) agree(*choice.truth, points);
}

bool needs_extent(const PlaceChoice& choice) { return !choice.like && !choice.area_w; }

GridFrame choose_frame(const PlaceChoice& choice, const Georeference& georeference,
                       const Area& points_m) {
  const glm::dvec3& origin_w_m = georeference.origin_w_m;
  Area area = points_m;
  if (choice.area_w) {
    area = {choice.area_w->low_m - glm::dvec2(origin_w_m),
            choice.area_w->high_m - glm::dvec2(origin_w_m)};
  }
  if (choice.like) {
    const Dem& like = choice.like->dem;
    const GridFrame frame = moved(like.grid.frame(), like.origin_w_m, origin_w_m);
    return choice.area_w ? frame_like(frame, area) : frame;
  }
  constexpr double share_of_cell = 1e-3;
  if (choice.cell_m) {
    return frame_over(choice.area_w ? area : with_border(area, *choice.cell_m * share_of_cell),
                      *choice.cell_m);
  }
  if (!choice.truth)
    throw Error("the resolution of the DEM is missing: give --cell-m, or --like another DEM");
  const Dem& truth = choice.truth->dem;
  const GridFrame frame = moved(truth.grid.frame(), truth.origin_w_m, origin_w_m);
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  const Area known =
      with_border({glm::min(a, b), glm::max(a, b)}, glm::length(frame.step_m) * share_of_cell);
  const Area both = area & known;
  if (both.is_empty()) {
    throw Error(
        "{}: no point is within its extent: is it the DEM that the points were measured over?",
        choice.truth->file.string());
  }
  return frame_like(frame, both);
}

}  // namespace groundray
