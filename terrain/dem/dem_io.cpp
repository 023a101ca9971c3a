#include "terrain/dem/dem_io.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_file.h"
#include "terrain/dem/dem_raster.h"

namespace groundray {
namespace {

constexpr std::int64_t max_samples = std::int64_t{1} << 31;

}  // namespace

Dem load_dem(const std::filesystem::path& path, const DemOptions& options) {
  const DemFile file(path, options);
  const DemHeader& header = file.header();
  const glm::ivec2 samples = header.samples;
  if (std::int64_t{samples.x} * samples.y > max_samples) {
    throw Error("{}: it has {} x {} samples, more than the limit of {}; crop it:{}", path.string(),
                samples.x, samples.y, max_samples,
                command(path, "gdal_translate -srcwin 0 0 32768 32768", "_part.tif"));
  }
  std::vector<float> heights_m = file.read({0, 0}, samples);
  if (std::ranges::all_of(heights_m, [](float z) { return std::isnan(z); })) {
    throw Error(
        "{}: none of its {} x {} samples has a height, all are nodata; is that value correct?",
        path.string(), samples.x, samples.y);
  }
  return {HeightGrid(samples, header.origin_m, header.step_m, std::move(heights_m)),
          header.origin_w_m, header.crs_wkt, header.crs_name};
}

bool is_same_crs(const std::string& wkt, const std::string& other) {
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  OGRSpatialReference a, b;
  if (a.SetFromUserInput(wkt.c_str()) != OGRERR_NONE) return false;
  if (b.SetFromUserInput(other.c_str()) != OGRERR_NONE) return false;
  if (a.IsCompound() != b.IsCompound()) {
    a.StripVertical();
    b.StripVertical();
  }
  return a.IsSame(&b) != 0;
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

}  // namespace groundray
