#pragma once

#include <gdal.h>
#include <ogr_srs_api.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"

namespace groundray::testing {

/// Description of a GeoTIFF to write through GDAL's C API.
struct GeoTiff {
  glm::ivec2 size{0};
  std::vector<double> values{};  // band by band
  std::array<double, 6> geotransform{500000, 2, 0, 5150000, 0, -2};
  std::string crs = "EPSG:32631";
  GDALDataType type = GDT_Float32;
  std::optional<double> nodata{};
  double scale = 1;
  double offset = 0;
  bool has_alpha = false;
  bool has_mask = false;  // masks every third sample
  std::vector<const char*> options{};

  void save(const std::filesystem::path& path) const {
    GDALAllRegister();
    std::vector<const char*> words = options;
    words.push_back(nullptr);
    const auto samples = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
    const int bands = static_cast<int>(values.size() / samples);
    const std::unique_ptr<void, decltype(&GDALClose)> dataset(
        GDALCreate(GDALGetDriverByName("GTiff"), path.c_str(), size.x, size.y, bands, type,
                   words.data()),
        &GDALClose);
    if (dataset == nullptr) throw std::runtime_error("GDAL cannot write " + path.string());
    auto transform = geotransform;
    GDALSetGeoTransform(dataset.get(), transform.data());
    OGRSpatialReferenceH reference = OSRNewSpatialReference(nullptr);
    OSRSetFromUserInput(reference, crs.c_str());
    if (!crs.empty()) GDALSetSpatialRef(dataset.get(), reference);
    OSRDestroySpatialReference(reference);
    for (int i = 0; i < bands; ++i) {
      GDALRasterBandH band = GDALGetRasterBand(dataset.get(), i + 1);
      if (nodata) GDALSetRasterNoDataValue(band, *nodata);
      if (scale != 1) GDALSetRasterScale(band, scale);
      if (offset != 0) GDALSetRasterOffset(band, offset);
      if (has_alpha && i == 1) GDALSetRasterColorInterpretation(band, GCI_AlphaBand);
      auto* from = const_cast<double*>(values.data() + static_cast<std::size_t>(i) * samples);
      write(band, from);
    }
    if (has_mask) write_mask(GDALGetRasterBand(dataset.get(), 1), samples);
  }

 private:
  void write(GDALRasterBandH band, double* from) const {
    if (GDALRasterIO(band, GF_Write, 0, 0, size.x, size.y, from, size.x, size.y, GDT_Float64, 0,
                     0) != CE_None) {
      throw std::runtime_error("GDAL cannot write a band");
    }
  }
  void write_mask(GDALRasterBandH band, std::size_t samples) const {
    GDALCreateMaskBand(band, GMF_PER_DATASET);
    std::vector<double> shown(samples, 255);
    for (std::size_t i = 0; i < samples; i += 3) shown[i] = 0;
    write(GDALGetMaskBand(band), shown.data());
  }
};

/// Writes the grid so that its heights are read back bit-identically, in tiles small enough to have
/// many of them.
inline void save_geotiff(const HeightGrid& grid, const std::filesystem::path& path) {
  const glm::dvec2 corner = grid.origin_m() - 0.5 * grid.step_m();
  const auto heights_m = grid.heights_m();
  GeoTiff{.size = {grid.columns(), grid.rows()},
          .values = {heights_m.begin(), heights_m.end()},
          .geotransform = {500000 + corner.x, grid.step_m().x, 0, 5150000 + corner.y, 0,
                           grid.step_m().y},
          .options = {"TILED=YES", "BLOCKXSIZE=32", "BLOCKYSIZE=32", "COMPRESS=DEFLATE"}}
      .save(path);
}

}  // namespace groundray::testing
