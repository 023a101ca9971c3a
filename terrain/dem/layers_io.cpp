#include "terrain/dem/layers_io.h"

#include <cpl_string.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/io/file_io.h"
#include "terrain/dem/gdal_raster.h"

namespace groundray {
namespace {

void check_grid(const GridFrame& frame, const Georeference& georeference, Violations& broken) {
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2,
                "they have {} x {} samples; a surface needs 2 x 2 or more", frame.samples.x,
                frame.samples.y);
  broken.unless(georeference.origin_w_m.z == 0, "the height of D's origin is {} m; it must be 0",
                georeference.origin_w_m.z);
}

void check_count(const GridFrame& frame, const std::string& name, std::size_t values,
                 Violations& broken) {
  const std::size_t samples =
      static_cast<std::size_t>(frame.samples.x) * static_cast<std::size_t>(frame.samples.y);
  broken.unless(values == samples, "{} has {} values for {} samples", name, values, samples);
}

void check_raster_layers(const GridFrame& frame, const Georeference& georeference,
                         std::span<const RasterLayer> layers) {
  Violations broken("raster layers");
  broken.unless(!layers.empty(), "there are no layers");
  check_grid(frame, georeference, broken);
  for (const RasterLayer& layer : layers)
    check_count(frame, layer.name, layer.values.size(), broken);
  broken.throw_if_any();
}

// Returns whether some sample has the nodata value as its height, or float cannot represent it.
bool is_misleading(double nodata, std::span<const RasterLayer> layers) {
  const auto value = static_cast<float>(nodata);
  if (double{value} != nodata || !std::isfinite(value)) return true;
  return std::ranges::any_of(layers, [value](const RasterLayer& layer) {
    return std::ranges::find(layer.values, value) != layer.values.end();
  });
}

// Adds a band that GDAL reads without a copy, from north and west.
template <typename Value>
GDALRasterBand& add_band(GDALDataset& dataset, const GridFrame& frame,
                         std::span<const Value> values, const std::string& name, double nodata) {
  const std::int64_t columns = frame.samples.x, rows = frame.samples.y;
  const bool is_from_west = frame.step_m.x > 0, is_from_north = frame.step_m.y < 0;
  const Value* const first =
      values.data() + (is_from_west ? 0 : columns - 1) + (is_from_north ? 0 : (rows - 1) * columns);
  constexpr std::int64_t bytes = sizeof(Value);
  CPLStringList options;
  options.SetNameValue("DATAPOINTER", fmt::format("{}", static_cast<const void*>(first)).c_str());
  options.SetNameValue("PIXELOFFSET", fmt::format("{}", is_from_west ? bytes : -bytes).c_str());
  options.SetNameValue(
      "LINEOFFSET", fmt::format("{}", is_from_north ? bytes * columns : -bytes * columns).c_str());
  dataset.AddBand(std::is_same_v<Value, float> ? GDT_Float32 : GDT_Byte, options.List());
  GDALRasterBand& band = *dataset.GetRasterBand(dataset.GetRasterCount());
  band.SetDescription(name.c_str());
  band.SetNoDataValue(nodata);
  return band;
}

OGRSpatialReference crs_of(const Georeference& georeference) {
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(georeference.crs_wkt.c_str()) != OGRERR_NONE) {
    constexpr std::size_t most = 80;
    throw Error(
        "the CRS '{}' is not known to PROJ: is its WKT (crs_wkt in a dataset.yaml) complete?",
        georeference.crs_wkt.substr(0, most));
  }
  return crs;
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
  OGRSpatialReference crs = with_heights_in_metres(crs_of(georeference));
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  dataset.SetSpatialRef(&crs);
}

// Returns a dataset in memory without bands.
GDALDatasetUniquePtr empty_dataset(const GridFrame& frame, const Georeference& georeference,
                                   bool is_point) {
  GDALDriver& memory = *GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDatasetUniquePtr dataset(
      memory.Create("", frame.samples.x, frame.samples.y, 0, GDT_Float32, nullptr));
  if (dataset == nullptr) throw Error("not enough memory for a raster: {}", CPLGetLastErrorMsg());
  place(*dataset, frame, georeference);
  dataset->SetMetadataItem("AREA_OR_POINT", is_point ? "Point" : "Area");
  return dataset;
}

GDALDatasetUniquePtr layers_dataset(const GridFrame& frame, const Georeference& georeference,
                                    std::span<const RasterLayer> layers, double nodata,
                                    const RasterForm& form) {
  GDALDatasetUniquePtr dataset = empty_dataset(frame, georeference, form.is_point);
  for (const RasterLayer& layer : layers) {
    GDALRasterBand& band = add_band(*dataset, frame, layer.values, layer.name, nodata);
    if (!layer.unit.empty()) band.SetUnitType(layer.unit.c_str());
  }
  return dataset;
}

CPLStringList cog_options(std::span<const RasterLayer> layers) {
  const bool are_lengths =
      std::ranges::none_of(layers, [](const RasterLayer& layer) { return layer.unit.empty(); });
  CPLStringList options;
  options.AddNameValue("COMPRESS", "DEFLATE");
  options.AddNameValue("PREDICTOR", "FLOATING_POINT");
  options.AddNameValue("BIGTIFF", "IF_SAFER");
  options.AddNameValue("OVERVIEW_RESAMPLING", are_lengths ? "AVERAGE" : "NEAREST");
  return options;
}

void copy_whole(const std::filesystem::path& path, GDALDataset& source,
                const CPLStringList& options) {
  write_whole(path, [&](const std::filesystem::path& part) {
    CPLErrorReset();
    GDALDriver& driver = *GetGDALDriverManager()->GetDriverByName("COG");
    GDALDatasetUniquePtr written(
        driver.CreateCopy(part.c_str(), &source, 0, options.List(), nullptr, nullptr));
    const bool is_there = written != nullptr;
    written.reset();
    if (!is_there || CPLGetLastErrorType() >= CE_Failure)
      throw Error("{}: cannot be written: {}; is the disk full?", path.string(),
                  CPLGetLastErrorMsg());
  });
}

}  // namespace

void check_crs(const Georeference& georeference) {
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  if (!georeference.crs_wkt.empty()) crs_of(georeference);
}

RasterForm read_form(const std::filesystem::path& path) {
  start_gdal();
  return about(path, [&] {
    const GDALDatasetUniquePtr dataset = open_raster(path);
    RasterForm form;
    int has_nodata = 0;
    const double nodata = dataset->GetRasterBand(1)->GetNoDataValue(&has_nodata);
    if (has_nodata != 0) form.nodata = nodata;
    const char* kind = dataset->GetMetadataItem("AREA_OR_POINT");
    form.is_point = kind != nullptr && std::string_view(kind) == "Point";
    return form;
  });
}

void write_layers(const std::filesystem::path& path, const GridFrame& frame,
                  const Georeference& georeference, std::span<const RasterLayer> layers,
                  const RasterForm& form) {
  about(path, [&] { check_raster_layers(frame, georeference, layers); });
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const bool is_nan = !form.nodata || is_misleading(*form.nodata, layers);
  const double nodata = is_nan ? nan : *form.nodata;
  std::vector<RasterLayer> stored(layers.begin(), layers.end());
  std::vector<std::vector<float>> copies;  // of layers, with the nodata value instead of NaN
  if (!is_nan) {
    for (RasterLayer& layer : stored) {
      copies.emplace_back(layer.values.begin(), layer.values.end());
      std::ranges::replace_if(
          copies.back(), [](float value) { return std::isnan(value); }, static_cast<float>(nodata));
      layer.values = copies.back();
    }
  }
  const GDALDatasetUniquePtr source = layers_dataset(frame, georeference, stored, nodata, form);
  copy_whole(path, *source, cog_options(layers));
}

void write_byte_layer(const std::filesystem::path& path, const GridFrame& frame,
                      const Georeference& georeference, const std::string& name,
                      std::span<const std::uint8_t> values, std::uint8_t nodata) {
  about(path, [&] {
    Violations broken("raster layer");
    check_grid(frame, georeference, broken);
    check_count(frame, name, values.size(), broken);
    broken.throw_if_any();
  });
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const GDALDatasetUniquePtr source = empty_dataset(frame, georeference, false);
  add_band(*source, frame, values, name, nodata);
  CPLStringList options;
  options.AddNameValue("COMPRESS", "DEFLATE");
  options.AddNameValue("BIGTIFF", "IF_SAFER");
  options.AddNameValue("OVERVIEW_RESAMPLING", "NEAREST");
  copy_whole(path, *source, options);
}

}  // namespace groundray
