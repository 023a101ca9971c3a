#include "terrain/dem/tiled_tiff.h"

#include <cpl_conv.h>
#include <cpl_string.h>

#include <algorithm>
#include <cassert>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "terrain/dem/row_major.h"

namespace groundray {
namespace {

GDALDataset& image_of(GDALDataset& dataset, int image) {
  if (image == 0) return dataset;
  return *dataset.GetRasterBand(1)->GetOverview(image - 1)->GetDataset();
}

int bands_of(const TiffSpec& spec) { return static_cast<int>(spec.bands.size()); }

CPLStringList tiff_options(int tile) {
  CPLStringList options;
  options.AddNameValue("TILED", "YES");
  options.AddNameValue("BLOCKXSIZE", fmt::format("{}", tile).c_str());
  options.AddNameValue("BLOCKYSIZE", fmt::format("{}", tile).c_str());
  // zlib's format, whose checksums detect damaged tiles. The predictor for floats (3) would take a
  // fifth less space and twice the time to read.
  options.AddNameValue("COMPRESS", "DEFLATE");
  options.AddNameValue("ZLEVEL", "1");
  options.AddNameValue("PREDICTOR", "2");
  options.AddNameValue("INTERLEAVE", "PIXEL");
  options.AddNameValue("BIGTIFF", "IF_SAFER");
  options.AddNameValue("NUM_THREADS", "ALL_CPUS");
  return options;
}

// Creates the overviews, without values.
CPLErr add_overviews(GDALDataset& dataset, const TiffSpec& spec) {
  if (spec.overviews == 0) return CE_None;
  std::vector<int> factors;
  for (int image = 1; image <= spec.overviews; ++image) factors.push_back(1 << image);
  const CPLConfigOptionSetter tile("GDAL_TIFF_OVR_BLOCKSIZE", fmt::format("{}", spec.tile).c_str(),
                                   false);
  return dataset.BuildOverviews("NONE", spec.overviews, factors.data(), 0, nullptr, nullptr,
                                nullptr);
}

bool is_as_specified(GDALDataset& dataset, const TiffSpec& spec) {
  if (dataset.GetRasterCount() != bands_of(spec)) return false;
  if (dataset.GetRasterBand(1)->GetOverviewCount() != spec.overviews) return false;
  for (int image = 0; image <= spec.overviews; ++image) {
    GDALDataset& part = image_of(dataset, image);
    if (glm::ivec2(part.GetRasterXSize(), part.GetRasterYSize()) != spec.image_size(image)) {
      return false;
    }
  }
  return dataset.GetRasterBand(1)->GetRasterDataType() == GDT_Float32;
}

}  // namespace

TiledTiffWriter::TiledTiffWriter(const std::filesystem::path& path, const TiffSpec& spec)
    : path_(path), spec_(spec) {
  start_gdal();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  CPLErrorReset();
  GDALDriver& driver = *GetGDALDriverManager()->GetDriverByName("GTiff");
  dataset_.reset(driver.Create(path.c_str(), spec.size.x, spec.size.y, bands_of(spec), GDT_Float32,
                               tiff_options(spec.tile).List()));
  if (dataset_ == nullptr) refuse_faults();
  double transform[] = {spec.corner_w_m.x, spec.cell_m.x, 0, spec.corner_w_m.y, 0, spec.cell_m.y};
  dataset_->SetGeoTransform(transform);
  if (!spec.crs_wkt.empty()) {
    OGRSpatialReference crs;
    crs.SetFromUserInput(spec.crs_wkt.c_str());
    dataset_->SetSpatialRef(&crs);
  }
  for (int band = 0; band < bands_of(spec); ++band) {
    dataset_->GetRasterBand(band + 1)->SetDescription(
        spec.bands[static_cast<std::size_t>(band)].c_str());
  }
  add_overviews(*dataset_, spec);
  refuse_faults();
}

TiledTiffWriter::~TiledTiffWriter() {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);  // failures have been reported earlier
  dataset_.reset();
}

void TiledTiffWriter::refuse_faults() const {
  if (CPLGetLastErrorType() != CE_Failure && CPLGetLastErrorType() != CE_Fatal) return;
  throw Error("{}: cannot be written: {}; is the disk full?", path_.string(), CPLGetLastErrorMsg());
}

void TiledTiffWriter::write(int image, glm::ivec2 first, glm::ivec2 size,
                            std::span<const float* const> bands) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  CPLErrorReset();
  const glm::ivec2 begin = first / spec_.tile;
  const glm::ivec2 end = (first + size - 1) / spec_.tile + 1;
  for (int row = begin.y; row < end.y; ++row) {
    for (int column = begin.x; column < end.x; ++column) {
      add_to_tile(image, {column, row}, first, size, bands);
    }
  }
}

void TiledTiffWriter::add_to_tile(int image, glm::ivec2 tile, glm::ivec2 first, glm::ivec2 size,
                                  std::span<const float* const> bands) {
  const std::tuple key(image, tile.y, tile.x);
  Pending& pending = pending_[key];
  const auto side = static_cast<std::size_t>(spec_.tile);
  pending.values.resize(side * side * bands.size());
  const glm::ivec2 corner = tile * spec_.tile;
  const glm::ivec2 whole = glm::min(glm::ivec2(spec_.tile), spec_.image_size(image) - corner);
  const glm::ivec2 low = glm::max(first, corner);
  const glm::ivec2 part = glm::min(first + size, corner + whole) - low;
  for (std::size_t band = 0; band < bands.size(); ++band) {
    for (int row = low.y; row < low.y + part.y; ++row) {
      const float* from = bands[band] + value_count({size.x, row - first.y}) + (low.x - first.x);
      std::copy_n(from, part.x,
                  pending.values.begin() +
                      static_cast<std::ptrdiff_t>(band * side * side +
                                                  value_count({spec_.tile, row - corner.y})) +
                      (low.x - corner.x));
    }
  }
  pending.cells += value_count(part);
  if (pending.cells < value_count(whole)) return;
  write_tile(image, tile, pending.values);
  pending_.erase(key);
}

void TiledTiffWriter::write_tile(int image, glm::ivec2 tile, std::vector<float>& values) {
  GDALDataset& dataset = image_of(*dataset_, image);
  const std::size_t count = values.size() / spec_.bands.size();
  for (int band = 0; band < bands_of(spec_); ++band) {
    // Bypasses GDAL's cache, which would write tiles in an order of its own.
    const CPLErr result = dataset.GetRasterBand(band + 1)->WriteBlock(
        tile.x, tile.y, values.data() + static_cast<std::size_t>(band) * count);
    if (result != CE_None) break;
  }
  refuse_faults();
}

void TiledTiffWriter::close() {
  assert(pending_.empty());
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  CPLErrorReset();
  dataset_.reset();
  refuse_faults();
}

TiledTiff::TiledTiff(const std::filesystem::path& path, const TiffSpec& spec)
    : path_(path), spec_(spec) {
  about(path, [&] {
    dataset_ = open_raster(path);
    if (!is_as_specified(*dataset_, spec)) throw Error("its layout is not the expected one");
  });
}

std::vector<float> TiledTiff::read(int image, glm::ivec2 first, glm::ivec2 size) const {
  const std::lock_guard lock(one_at_a_time_);
  return about(path_, [&] {
    if (image < 0 || image > spec_.overviews) throw Error("it has no image {}", image);
    const glm::ivec2 all = spec_.image_size(image);
    if (glm::any(glm::lessThan(first, glm::ivec2(0))) ||
        glm::any(glm::lessThan(size, glm::ivec2(1))) ||
        glm::any(glm::greaterThan(size, all - first))) {
      throw Error("a window of {} x {} cells at column {}, row {} exceeds image {} of {} x {}",
                  size.x, size.y, first.x, first.y, image, all.x, all.y);
    }
    std::vector<float> values(value_count(size) * spec_.bands.size());
    CPLErrorReset();
    const CPLErr result =
        image_of(*dataset_, image)
            .RasterIO(GF_Read, first.x, first.y, size.x, size.y, values.data(), size.x, size.y,
                      GDT_Float32, bands_of(spec_), nullptr, 0, 0, 0, nullptr);
    if (result != CE_None || CPLGetLastErrorType() == CE_Failure) {
      throw Error("its values cannot be read: {}; delete the folder, and it will be recomputed",
                  CPLGetLastErrorMsg());
    }
    return values;
  });
}

}  // namespace groundray
