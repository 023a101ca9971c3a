#include "terrain/dem_writer.h"

#include <cpl_string.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "core/product_io.h"
#include "terrain/dem_raster.h"

namespace groundray {
namespace {

// The asked value if no height is mistaken for it and floats can tell it, else NaN.
float hole_value(const DemPlace& place, std::span<const float> values_m) {
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  if (!place.nodata) return none;
  const auto value = static_cast<float>(*place.nodata);
  const bool is_told = double{value} == *place.nodata && std::isfinite(value);
  return is_told && std::ranges::find(values_m, value) == values_m.end() ? value : none;
}

// A raster in memory, as GDAL's drivers copy it.
GDALDatasetUniquePtr raster_of(const DemPlace& place, std::vector<float>& values_m, float hole) {
  const GridFrame& frame = place.frame;
  GDALDriver& memory = *GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDatasetUniquePtr dataset(
      memory.Create("", frame.samples.x, frame.samples.y, 1, GDT_Float32, nullptr));
  if (dataset == nullptr) throw Error("there is no memory for a raster: {}", CPLGetLastErrorMsg());
  const glm::dvec2 corner = glm::dvec2(place.origin_w_m) + frame.origin_m - 0.5 * frame.step_m;
  double transform[] = {corner.x, frame.step_m.x, 0, corner.y, 0, frame.step_m.y};
  dataset->SetGeoTransform(transform);
  if (!place.crs_wkt.empty()) {
    OGRSpatialReference crs;
    crs.SetFromUserInput(place.crs_wkt.c_str());
    crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    dataset->SetSpatialRef(&crs);
  }
  dataset->SetMetadataItem("AREA_OR_POINT", place.is_point ? "Point" : "Area");
  GDALRasterBand& band = *dataset->GetRasterBand(1);
  band.SetNoDataValue(hole);
  band.SetDescription(place.name.c_str());
  band.SetUnitType("m");
  if (band.RasterIO(GF_Write, 0, 0, frame.samples.x, frame.samples.y, values_m.data(),
                    frame.samples.x, frame.samples.y, GDT_Float32, 0, 0, nullptr) != CE_None)
    throw Error("its values cannot be copied: {}", CPLGetLastErrorMsg());
  return dataset;
}

void check(const DemPlace& place, std::span<const float> values_m) {
  const glm::ivec2 samples = place.frame.samples;
  Violations broken("writing a raster");
  broken.unless(std::ssize(values_m) == std::int64_t{samples.x} * samples.y,
                "there are {} values for {} x {} samples", values_m.size(), samples.x, samples.y);
  broken.unless(place.frame.step_m.x > 0 && place.frame.step_m.y < 0,
                "step_m = [{}, {}] must run west to east and north to south: [+, -]",
                place.frame.step_m.x, place.frame.step_m.y);
  broken.throw_if_any();
}

}  // namespace

DemPlace describe_file(const std::filesystem::path& path) {
  return about(path, [&] {
    const GDALDatasetUniquePtr dataset = open_raster(path);
    DemPlace place;
    int has_nodata = 0;
    const double nodata = dataset->GetRasterBand(1)->GetNoDataValue(&has_nodata);
    if (has_nodata != 0) place.nodata = nodata;
    const char* kind = dataset->GetMetadataItem("AREA_OR_POINT");
    place.is_point = kind != nullptr && std::string_view(kind) == "Point";
    return place;
  });
}

void write_dem(const std::filesystem::path& path, const DemPlace& place,
               std::span<const float> values_m) {
  check(place, values_m);
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const float hole = hole_value(place, values_m);
  std::vector<float> stored(values_m.begin(), values_m.end());
  if (!std::isnan(hole)) {
    std::ranges::replace_if(
        stored, [](float value) { return std::isnan(value); }, hole);
  }
  const GDALDatasetUniquePtr raster = raster_of(place, stored, hole);
  CPLStringList options;
  options.AddNameValue("COMPRESS", "DEFLATE");
  options.AddNameValue("PREDICTOR", "YES");
  options.AddNameValue("OVERVIEW_RESAMPLING", "AVERAGE");
  options.AddNameValue("BIGTIFF", "IF_SAFER");
  write_whole(path, [&](const std::filesystem::path& part) {
    CPLErrorReset();
    GDALDatasetUniquePtr copy(GetGDALDriverManager()->GetDriverByName("COG")->CreateCopy(
        part.c_str(), raster.get(), FALSE, options.List(), nullptr, nullptr));
    const bool is_made = copy != nullptr;
    copy.reset();
    if (!is_made || CPLGetLastErrorType() >= CE_Failure)
      throw Error("{}: cannot be written: {}; is the disk full?", path.string(),
                  CPLGetLastErrorMsg());
  });
}

}  // namespace groundray
