#include "terrain/layers_io.h"

#include <cpl_string.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>

#include "core/product_io.h"
#include "terrain/dem_raster.h"

namespace groundray {
namespace {

void check(const GridFrame& frame, const Georeference& georeference,
           std::span<const RasterLayer> layers) {
  Violations broken("not layers of a raster");
  broken.unless(!layers.empty(), "there is none");
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2,
                "they have {} x {} samples; a surface needs 2 x 2 or more", frame.samples.x,
                frame.samples.y);
  broken.unless(georeference.origin_w_m.z == 0, "D's origin is {} m high; it must be 0",
                georeference.origin_w_m.z);
  const std::size_t samples =
      static_cast<std::size_t>(frame.samples.x) * static_cast<std::size_t>(frame.samples.y);
  for (const RasterLayer& layer : layers)
    broken.unless(layer.values.size() == samples, "{} has {} values for {} samples", layer.name,
                  layer.values.size(), samples);
  broken.throw_if_any();
}

// Adds a band that GDAL sees without a copy, north and west first.
void add_band(GDALDataset& dataset, const GridFrame& frame, const RasterLayer& layer) {
  const std::int64_t columns = frame.samples.x, rows = frame.samples.y;
  const bool is_from_west = frame.step_m.x > 0, is_from_north = frame.step_m.y < 0;
  const float* const first = layer.values.data() + (is_from_west ? 0 : columns - 1) +
                             (is_from_north ? 0 : (rows - 1) * columns);
  constexpr std::int64_t bytes = sizeof(float);
  CPLStringList options;
  options.SetNameValue("DATAPOINTER", fmt::format("{}", static_cast<const void*>(first)).c_str());
  options.SetNameValue("PIXELOFFSET", fmt::format("{}", is_from_west ? bytes : -bytes).c_str());
  options.SetNameValue(
      "LINEOFFSET", fmt::format("{}", is_from_north ? bytes * columns : -bytes * columns).c_str());
  dataset.AddBand(GDT_Float32, options.List());
  GDALRasterBand& band = *dataset.GetRasterBand(dataset.GetRasterCount());
  band.SetDescription(layer.name.c_str());
  band.SetNoDataValue(std::numeric_limits<double>::quiet_NaN());
  if (!layer.unit.empty()) band.SetUnitType(layer.unit.c_str());
}

void place(GDALDataset& dataset, const GridFrame& frame, const Georeference& georeference) {
  const glm::dvec2 first = frame.origin_m;
  const glm::dvec2 last = frame.to_D(frame.samples - 1);
  const glm::dvec2 step = glm::abs(frame.step_m);
  const double west = std::min(first.x, last.x) - step.x / 2 + georeference.origin_w_m.x;
  const double north = std::max(first.y, last.y) + step.y / 2 + georeference.origin_w_m.y;
  std::array<double, 6> transform{west, step.x, 0, north, 0, -step.y};
  dataset.SetGeoTransform(transform.data());
  if (georeference.crs_wkt.empty()) return;
  OGRSpatialReference crs;
  crs.SetFromUserInput(georeference.crs_wkt.c_str());
  dataset.SetSpatialRef(&crs);
}

GDALDatasetUniquePtr dataset_of(const GridFrame& frame, const Georeference& georeference,
                                std::span<const RasterLayer> layers) {
  GDALDriver& memory = *GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDatasetUniquePtr dataset(
      memory.Create("", frame.samples.x, frame.samples.y, 0, GDT_Float32, nullptr));
  for (const RasterLayer& layer : layers) add_band(*dataset, frame, layer);
  place(*dataset, frame, georeference);
  return dataset;
}

CPLStringList creation_options() {
  CPLStringList options;
  options.AddNameValue("COMPRESS", "DEFLATE");
  options.AddNameValue("PREDICTOR", "FLOATING_POINT");
  options.AddNameValue("BIGTIFF", "IF_SAFER");
  options.AddNameValue("OVERVIEW_RESAMPLING", "NEAREST");  // means of counts and flags say nothing
  return options;
}

}  // namespace

void write_layers(const std::filesystem::path& path, const GridFrame& frame,
                  const Georeference& georeference, std::span<const RasterLayer> layers) {
  about(path, [&] { check(frame, georeference, layers); });
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const GDALDatasetUniquePtr source = dataset_of(frame, georeference, layers);
  write_whole(path, [&](const std::filesystem::path& part) {
    CPLErrorReset();
    GDALDriver& driver = *GetGDALDriverManager()->GetDriverByName("COG");
    GDALDatasetUniquePtr written(driver.CreateCopy(part.c_str(), source.get(), 0,
                                                   creation_options().List(), nullptr, nullptr));
    const bool is_there = written != nullptr;
    written.reset();
    if (!is_there || CPLGetLastErrorType() >= CE_Failure)
      throw Error("{}: cannot be written: {}; is the disk full?", path.string(),
                  CPLGetLastErrorMsg());
  });
}

}  // namespace groundray
