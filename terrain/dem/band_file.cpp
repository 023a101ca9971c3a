#include "terrain/dem/band_file.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "terrain/dem/gdal_raster.h"
#include "terrain/dem/raster_input.h"

namespace groundray {
namespace {

int step_for(glm::ivec2 samples, std::size_t most) {
  int step = 1;
  const auto count = [&] {
    const glm::ivec2 kept = (samples - 1) / step + 1;
    return static_cast<std::size_t>(kept.x) * static_cast<std::size_t>(kept.y);
  };
  while (count() > most) ++step;
  return step;
}

// Reads one row of a band and of its mask, which is 0 where there is no value.
void read_row(GDALRasterBand& band, int row, int columns, std::vector<double>& values,
              std::vector<std::uint8_t>& mask) {
  if (band.RasterIO(GF_Read, 0, row, columns, 1, values.data(), columns, 1, GDT_Float64, 0, 0,
                    nullptr) != CE_None ||
      band.GetMaskBand()->RasterIO(GF_Read, 0, row, columns, 1, mask.data(), columns, 1, GDT_Byte,
                                   0, 0, nullptr) != CE_None)
    throw Error("row {} of band {} cannot be read: {}", row, band.GetBand(), CPLGetLastErrorMsg());
}

RasterBands::Band read_band(GDALRasterBand& band, glm::ivec2 samples, int step) {
  if (GDALDataTypeIsComplex(band.GetRasterDataType()) != 0)
    throw Error("band {} contains complex numbers: convert them to real parts or magnitudes",
                band.GetBand());
  RasterBands::Band taken;
  const std::string description = band.GetDescription();
  taken.name = description.empty() ? fmt::format("band {}", band.GetBand()) : description;
  taken.unit = band.GetUnitType();
  const double scale = band.GetScale(), offset = band.GetOffset();
  std::vector<double> values(static_cast<std::size_t>(samples.x));
  std::vector<std::uint8_t> mask(values.size());
  for (int row = 0; row < samples.y; row += step) {
    read_row(band, row, samples.x, values, mask);
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(step))
      taken.values.push_back(mask[i] == 0 ? std::numeric_limits<float>::quiet_NaN()
                                          : static_cast<float>(values[i] * scale + offset));
  }
  return taken;
}

void check_size(glm::ivec2 samples, int bands) {
  constexpr double most_bytes = 4.0 * (1 << 30);
  const double bytes = 4.0 * samples.x * samples.y * bands;
  if (bytes <= most_bytes) return;
  throw Error(
      "{} bands of {} x {} samples take {:.1f} GB, more than the limit of {:.1f} GB: "
      "request fewer bands or samples",
      bands, samples.x, samples.y, bytes / 1e9, most_bytes / 1e9);
}

}  // namespace

RasterBands read_bands(const std::filesystem::path& path, std::size_t most_samples,
                       int most_bands) {
  return about(path, [&] {
    if (most_samples == 0) throw Error("at most 0 samples are requested: request 1 or more");
    const GDALDatasetUniquePtr dataset = open_raster(path);
    const glm::ivec2 samples(dataset->GetRasterXSize(), dataset->GetRasterYSize());
    RasterBands bands;
    bands.step = step_for(samples, most_samples);
    bands.samples = (samples - 1) / bands.step + 1;
    const int all = dataset->GetRasterCount();
    const int count = most_bands > 0 ? std::min(all, most_bands) : all;
    check_size(bands.samples, count);
    check_memory(path, samples, 4.0 * bands.samples.x * bands.samples.y * count + 9.0 * samples.x);
    for (int i = 1; i <= count; ++i)
      bands.bands.push_back(read_band(*dataset->GetRasterBand(i), samples, bands.step));
    return bands;
  });
}

RasterKind inspect_raster(const std::filesystem::path& path) {
  return about(path, [&] {
    const GDALDatasetUniquePtr dataset = open_raster(path);
    RasterKind kind{.samples = {dataset->GetRasterXSize(), dataset->GetRasterYSize()},
                    .bands = dataset->GetRasterCount()};
    const OGRSpatialReference* const crs = dataset->GetSpatialRef();
    kind.is_geographic = crs != nullptr && crs->IsGeographic() != 0;
    kind.is_picture = kind.bands >= 3;
    for (int i = 1; i <= std::min(kind.bands, 3); ++i)
      kind.is_picture &= dataset->GetRasterBand(i)->GetRasterDataType() == GDT_Byte;
    return kind;
  });
}

}  // namespace groundray
