#include "terrain/dem/dem_file.h"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <mutex>
#include <set>
#include <string_view>
#include <utility>

#include "core/random.h"
#include "terrain/dem/byte_hash.h"
#include "terrain/dem/dem_warp.h"
#include "terrain/dem/gdal_raster.h"
#include "terrain/dem/raster_input.h"

namespace groundray {

/// Open file; members are in the order of their dependence.
struct DemFile::Opened {
  Opened(const std::filesystem::path& file, const DemOptions& wishes)
      : path(file), options(wishes), dataset(open_raster(file)), raster(read_header(*dataset)) {
    if (options.reproject_to.empty()) check_placed(*dataset, raster, options.nodata);
    heights = std::make_unique<HeightReader>(*dataset, raster.crs, options.nodata);
    if (!options.reproject_to.empty()) {
      warped = reprojected(*heights, raster, options.reproject_to);
    }
    set_header(warped ? warped->header() : raster);
  }

  void set_header(const RasterHeader& from) {
    const auto& gt = from.geotransform;
    const glm::dvec2 origin_w_m = glm::round(from.centre());
    header.samples = from.samples;
    header.step_m = {gt[1], gt[5]};
    // The difference of two close numbers is exact, so it comes first.
    header.origin_m = (glm::dvec2(gt[0], gt[3]) - origin_w_m) + 0.5 * header.step_m;
    header.origin_w_m = glm::dvec3(origin_w_m, 0);
    const OGRSpatialReference crs = with_heights_in_metres(from.crs);
    header.crs_wkt = wkt_of(crs);
    header.crs_name = name_of(crs);
  }

  std::filesystem::path path;
  DemOptions options;
  GDALDatasetUniquePtr dataset;
  RasterHeader raster;
  std::unique_ptr<HeightReader> heights;
  std::unique_ptr<WarpedHeights> warped;  // null if heights are read as stored
  DemHeader header;
  std::mutex one_at_a_time;
};

namespace {

// Returns the absolute path of a file; anything that names no file is returned unchanged.
std::string full_name(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return path.string();
  return std::filesystem::absolute(path).lexically_normal().string();
}

// Adds the files of a dataset. GDAL lists those of a mosaic, but not those of mosaics inside it.
// Statistics and overviews are excluded: viewers add them, and other changes to these files show in
// the header.
void add_files(GDALDataset& dataset, std::set<std::string>& names) {
  const CPLStringList files(dataset.GetFileList(), TRUE);
  for (int i = 0; i < files.size(); ++i) {
    const std::string_view name = files[i];
    if (name.ends_with(".aux.xml") || name.ends_with(".ovr")) continue;
    if (!names.insert(files[i]).second || !name.ends_with(".vrt")) continue;
    add_files(*open_input(files[i]), names);
  }
}

// Returns one line for each file of the dataset.
std::string files_text(GDALDataset& dataset) {
  std::set<std::string> names;
  add_files(dataset, names);
  std::string text;
  for (const std::string& name : names) {
    VSIStatBufL state;
    if (VSIStatL(name.c_str(), &state) != 0) state = {};
    text += fmt::format("file {} {} bytes, time {}.{:09}\n", full_name(name), state.st_size,
                        state.st_mtim.tv_sec, state.st_mtim.tv_nsec);
  }
  return text;
}

// Returns a hash of small windows of the file: at its corners and at scattered positions.
std::uint64_t sample_hash(const DemFile& file) {
  constexpr int windows = 32;
  constexpr int side = 32;
  const glm::ivec2 size = glm::min(file.header().samples, glm::ivec2(side));
  const glm::ivec2 room = file.header().samples - size;
  std::string bytes;
  for (int i = 0; i < windows; ++i) {
    const glm::dvec2 place =
        i < 4 ? glm::dvec2(i % 2, i / 2) : random_uniform({.pulse = static_cast<std::uint32_t>(i)});
    const auto part = file.read(glm::ivec2(place * glm::dvec2(room)), size);
    for (const float z : part) {
      // NaN is a hole, whatever its bits.
      const auto bits = std::bit_cast<std::array<char, sizeof z>>(z == z ? z : 1e38f);
      bytes.append(bits.data(), bits.size());
    }
  }
  return byte_hash(bytes);
}

}  // namespace

DemFile::DemFile(const std::filesystem::path& path, const DemOptions& options)
    : opened_(about(path, [&] { return std::make_unique<Opened>(path, options); })) {}

DemFile::~DemFile() = default;
DemFile::DemFile(DemFile&&) noexcept = default;
DemFile& DemFile::operator=(DemFile&&) noexcept = default;

const std::filesystem::path& DemFile::path() const noexcept { return opened_->path; }
const DemOptions& DemFile::options() const noexcept { return opened_->options; }
const DemHeader& DemFile::header() const noexcept { return opened_->header; }

std::vector<float> DemFile::read(glm::ivec2 first, glm::ivec2 size) const {
  return about(opened_->path, [&] {
    const glm::ivec2 samples = header().samples;
    const auto is_within = [](int from, int count, int all) {
      return 0 <= from && 0 < count && count <= all && from <= all - count;
    };
    if (!is_within(first.x, size.x, samples.x) || !is_within(first.y, size.y, samples.y)) {
      throw Error("a window of {} x {} samples at column {}, row {} exceeds its {} x {} samples",
                  size.x, size.y, first.x, first.y, samples.x, samples.y);
    }
    std::vector<float> heights_m(static_cast<std::size_t>(size.x) *
                                 static_cast<std::size_t>(size.y));
    const std::lock_guard lock(opened_->one_at_a_time);
    if (opened_->warped) {
      opened_->warped->read(first, size, heights_m.data());
    } else {
      opened_->heights->read(first, size, heights_m.data());
    }
    return heights_m;
  });
}

Dem DemFile::load() const {
  const std::filesystem::path& path = opened_->path;
  const DemHeader& header = opened_->header;
  const glm::ivec2 samples = header.samples;
  constexpr std::int64_t max_samples = std::int64_t{1} << 31;
  if (std::int64_t{samples.x} * samples.y > max_samples) {
    throw Error("{}: it has {} x {} samples, more than the limit of {}; crop it:{}", path.string(),
                samples.x, samples.y, max_samples,
                command(path, "gdal_translate -srcwin 0 0 32768 32768", "_part.tif"));
  }
  about(path, [&] { check_memory(path, samples, 4.0 * samples.x * samples.y); });
  std::vector<float> heights_m = read({0, 0}, samples);
  if (std::ranges::all_of(heights_m, [](float z) { return std::isnan(z); })) {
    throw Error(
        "{}: none of its {} x {} samples has a height, all are nodata; is that value correct?",
        path.string(), samples.x, samples.y);
  }
  return {HeightGrid(samples, header.origin_m, header.step_m, std::move(heights_m)),
          header.origin_w_m, header.crs_wkt, header.crs_name};
}

std::string DemFile::fingerprint() const {
  const std::uint64_t samples = sample_hash(*this);
  const RasterHeader& raster = opened_->raster;
  const std::lock_guard lock(opened_->one_at_a_time);
  return fmt::format(
      "path {}\nreproject_to '{}'\nsize {} x {}\ngeotransform {}\ncrs {:016x}\nstored {}\n{}"
      "samples {:016x}\n",
      full_name(opened_->path), opened_->options.reproject_to, raster.samples.x, raster.samples.y,
      fmt::join(raster.geotransform, " "), byte_hash(wkt_of(raster.crs)),
      opened_->heights->conversion(), files_text(*opened_->dataset), samples);
}

}  // namespace groundray
