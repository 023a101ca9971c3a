#include "terrain/dem/dem_io.h"

#include <gdal_alg.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_file.h"
#include "terrain/dem/gdal_raster.h"

namespace groundray {
namespace {

// Returns an in-memory raster that holds `values`.
template <typename Value>
GDALDatasetUniquePtr raster_of(glm::ivec2 size, std::vector<Value>& values, GDALDataType type) {
  GDALDatasetUniquePtr dataset(
      GetGDALDriverManager()->GetDriverByName("MEM")->Create("", size.x, size.y, 1, type, nullptr));
  const bool is_done = dataset != nullptr && dataset->GetRasterBand(1)->RasterIO(
                                                 GF_Write, 0, 0, size.x, size.y, values.data(),
                                                 size.x, size.y, type, 0, 0, nullptr) == CE_None;
  if (!is_done) throw Error("GDAL cannot allocate a raster: {}", CPLGetLastErrorMsg());
  return dataset;
}

}  // namespace

Dem load_dem(const std::filesystem::path& path, const DemOptions& options) {
  return DemFile(path, options).load();
}

bool is_same_crs(const std::string& wkt, const std::string& other) {
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  OGRSpatialReference a, b;
  if (a.SetFromUserInput(wkt.c_str()) != OGRERR_NONE) return false;
  if (b.SetFromUserInput(other.c_str()) != OGRERR_NONE) return false;
  a = with_heights_in_metres(a);  // as heights in memory are
  b = with_heights_in_metres(b);
  if (a.IsCompound() != b.IsCompound()) {
    a.StripVertical();
    b.StripVertical();
  }
  return a.IsSame(&b) != 0 || wkt_of(a) == wkt_of(b);
}

DemInfo inspect_dem(const std::filesystem::path& path) {
  return about(path, [&] {
    const GDALDatasetUniquePtr dataset = open_raster(path);
    const RasterHeader header = read_header(*dataset);
    const GDALDataType type = dataset->GetRasterBand(1)->GetRasterDataType();
    return DemInfo{header.samples.x, header.samples.y, dataset->GetDriverName(),
                   GDALGetDataTypeName(type), name_of(header.crs)};
  });
}

std::vector<float> fill_by_gdal(glm::ivec2 size, std::span<const float> heights_m,
                                double farthest_cells) {
  if (std::ssize(heights_m) != std::int64_t{size.x} * size.y)
    throw Error("filling by GDAL: {} heights for {} x {} samples", heights_m.size(), size.x,
                size.y);
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  std::vector<float> values(heights_m.begin(), heights_m.end());
  std::vector<std::uint8_t> has_data(values.size());
  std::ranges::transform(values, has_data.begin(),
                         [](float z) { return static_cast<std::uint8_t>(!std::isnan(z)); });
  const GDALDatasetUniquePtr raster = raster_of(size, values, GDT_Float32);
  const GDALDatasetUniquePtr mask = raster_of(size, has_data, GDT_Byte);
  const bool is_done =
      GDALFillNodata(raster->GetRasterBand(1), mask->GetRasterBand(1), farthest_cells, 0, 0,
                     nullptr, nullptr, nullptr) == CE_None &&
      raster->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, size.x, size.y, values.data(), size.x,
                                         size.y, GDT_Float32, 0, 0, nullptr) == CE_None;
  if (!is_done) throw Error("filling by GDAL failed: {}", CPLGetLastErrorMsg());
  return values;
}

}  // namespace groundray
