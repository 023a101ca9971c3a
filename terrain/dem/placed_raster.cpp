#include "terrain/dem/placed_raster.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/error.h"
#include "terrain/dem/dem_warp.h"

namespace groundray {

void flatten(OGRSpatialReference& crs) {
  crs.StripVertical();
  crs.DemoteTo2D(nullptr);
}

std::optional<OGRSpatialReference> crs_to_reach(const OGRSpatialReference& raster,
                                                const std::string& crs_wkt) {
  if (crs_wkt.empty() || raster.IsEmpty()) return std::nullopt;
  OGRSpatialReference world;
  if (world.SetFromUserInput(crs_wkt.c_str()) != OGRERR_NONE) {
    throw Error("the ground's CRS, '{}', is not known to GDAL: {}", crs_wkt, CPLGetLastErrorMsg());
  }
  world.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  flatten(world);
  if (raster.IsLocal() || world.IsLocal()) {
    if (raster.IsSame(&world) != 0) return std::nullopt;
    throw Error(
        "its CRS is {}, the ground's is {}: one of them is local, so there is no transformation "
        "between them; if they are the same, assign the ground's with gdal_edit.py -a_srs",
        name_of(raster), name_of(world));
  }
  return world;
}

void check_pixels(const std::filesystem::path& path, glm::ivec2 source, glm::ivec2 result,
                  std::int64_t most_pixels) {
  const double pixels = static_cast<double>(result.x) * result.y;
  const auto most = static_cast<double>(most_pixels);
  if (pixels <= most) return;
  // Leaves a margin for a warp, which rounds the size of its pixels.
  const double scale = std::sqrt(most / pixels) * (source == result ? 1 : 0.9);
  const double columns = std::clamp(std::floor(source.x * scale), 2.0, most / 2);
  const double rows = std::clamp(std::floor(source.y * scale), 2.0, std::floor(most / columns));
  const std::string size = fmt::format("{:.0f} {:.0f}", columns, rows);
  throw Error("it has {} x {} pixels{}, more than the limit of {}; make them larger:{}", result.x,
              result.y, source == result ? "" : " in the ground's CRS", most_pixels,
              command(path, "gdal_translate -r average -outsize " + size, "_small.tif"));
}

PlacedRaster load_placed_raster(const std::filesystem::path& path, std::optional<double> nodata,
                                const std::string& crs_wkt, std::int64_t most_pixels) {
  const GDALDatasetUniquePtr dataset = open_raster(path);
  RasterHeader header = read_header(*dataset);
  flatten(header.crs);
  const HeightReader values(*dataset, header.crs, nodata, /*unit_m=*/1);
  const glm::ivec2 source = header.samples;
  std::unique_ptr<WarpedHeights> warped;
  if (const auto world = crs_to_reach(header.crs, crs_wkt)) {
    warped = reprojected(values, header, wkt_of(*world));
  } else {
    check_placed(*dataset, header, nodata);
  }
  if (warped) header = warped->header();
  const glm::ivec2 size = header.samples;
  check_pixels(path, source, size, most_pixels);
  const auto& gt = header.geotransform;
  PlacedRaster raster{size, {gt[0], gt[3]}, {gt[1], gt[5]}, warped != nullptr, {}};
  raster.values.resize(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
  if (warped) {
    warped->read({0, 0}, size, raster.values.data());
  } else {
    values.read({0, 0}, size, raster.values.data());
  }
  return raster;
}

}  // namespace groundray
