#include "terrain/dem/dem_warp.h"

#include <cpl_string.h>
#include <fmt/ranges.h>
#include <gdal_alg.h>
#include <gdal_pam.h>
#include <gdal_utils.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <glm/common.hpp>
#include <limits>
#include <utility>

#include "core/io/text_lines.h"
#include "terrain/dem/raster_input.h"

namespace groundray {

std::string why_not_metric(const OGRSpatialReference& crs) {
  if (crs.IsEmpty()) return {};
  const std::string subject = fmt::format("its CRS, {},", name_of(crs));
  if (crs.IsGeographic()) return subject + " is geographic: its unit is an angle, not the metre";
  if (!crs.IsProjected() && !crs.IsLocal()) return subject + " is neither projected nor local";
  const char* unit = nullptr;
  const double unit_m = crs.GetLinearUnits(&unit);
  if (unit_m == 1) return {};
  return fmt::format("{} has the unit {} ({} m), not the metre", subject, unit, unit_m);
}

std::string fitting_crs(const RasterHeader& raster) {
  const double a_m = raster.crs.GetSemiMajor();
  const double b_m = raster.crs.GetSemiMinor();
  const bool on_earth = 6.35e6 < b_m && a_m < 6.40e6;
  const std::string body =
      a_m == b_m ? fmt::format("+R={}", a_m) : fmt::format("+a={} +b={}", a_m, b_m);
  OGRSpatialReference geographic;
  geographic.SetFromUserInput(on_earth ? "EPSG:4326" : ("+proj=longlat +no_defs " + body).c_str());
  geographic.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_geographic(
      OGRCreateCoordinateTransformation(&raster.crs, &geographic));
  const glm::dvec2 centre = raster.centre();
  double longitude_deg = centre.x;
  double latitude_deg = centre.y;
  if (to_geographic == nullptr || !to_geographic->Transform(1, &longitude_deg, &latitude_deg)) {
    throw Error(
        "its centre ({}, {}) has no longitude and latitude in its CRS, {}; is its geotransform "
        "correct?",
        centre.x, centre.y, name_of(raster.crs));
  }
  if (!on_earth) {
    return fmt::format("+proj=tmerc +lat_0={:.4f} +lon_0={:.4f} {} +units=m +no_defs", latitude_deg,
                       longitude_deg, body);
  }
  if (latitude_deg > 84) return "EPSG:32661";
  if (latitude_deg < -80) return "EPSG:32761";
  const double turns = (longitude_deg + 180) / 360;
  const int zone = static_cast<int>(60 * (turns - std::floor(turns))) + 1;
  return fmt::format("EPSG:{}", (latitude_deg < 0 ? 32700 : 32600) + zone);
}

namespace {

// Returns the options of gdalwarp that warp `dataset` to `target` (empty: keep its CRS, undo a
// rotation): square cells about as large as its own, heights neither rounded nor shifted, and
// positions off by at most 1 % of a cell.
std::vector<std::string> warp_options(GDALDataset& dataset, const std::string& target) {
  CPLStringList transform;
  if (!target.empty()) transform.AddNameValue("DST_SRS", target.c_str());
  const std::unique_ptr<void, decltype(&GDALDestroyGenImgProjTransformer)> transformer(
      GDALCreateGenImgProjTransformer2(&dataset, nullptr, transform.List()),
      &GDALDestroyGenImgProjTransformer);
  std::array<double, 6> gt{};
  int columns = 0;
  int rows = 0;
  if (transformer == nullptr ||
      GDALSuggestedWarpOutput(&dataset, &GDALGenImgProjTransform, transformer.get(), gt.data(),
                              &columns, &rows) != CE_None) {
    throw Error("it cannot be reprojected to {}: {}", target, CPLGetLastErrorMsg());
  }
  // Two digits. std::stod would depend on the locale.
  const std::string cell_m =
      fmt::format("{}", number_of<double>(fmt::format("{:.1e}", gt[1])).value());
  std::vector<std::string> options;
  if (!target.empty()) options = {"-t_srs", target};
  for (const char* word :
       {"-tr", cell_m.c_str(), cell_m.c_str(), "-r", "bilinear", "-et", "0.01", "-ot", "Float32",
        "-dstnodata", "nan", "-novshift", "-wo", "XSCALE=1", "-wo", "YSCALE=1"}) {
    options.emplace_back(word);
  }
  return options;
}

// Band of converted heights for GDAL to read from, NaN where there is none.
class SourceBand final : public GDALPamRasterBand {
 public:
  SourceBand(GDALDataset& dataset, const HeightReader& heights, std::exception_ptr& fault)
      : heights_(heights), fault_(fault) {
    poDS = &dataset;
    nBand = 1;
    eDataType = GDT_Float32;
    heights.band().GetBlockSize(&nBlockXSize, &nBlockYSize);
    nRasterXSize = dataset.GetRasterXSize();
    nRasterYSize = dataset.GetRasterYSize();
    SetNoDataValue(std::numeric_limits<double>::quiet_NaN());
  }

 protected:
  CPLErr IReadBlock(int column, int row, void* values) override {  // NOLINT(*-naming): GDAL's
    const glm::ivec2 block(nBlockXSize, nBlockYSize);
    const glm::ivec2 first = glm::ivec2(column, row) * block;
    const glm::ivec2 size = glm::min(block, glm::ivec2(nRasterXSize, nRasterYSize) - first);
    auto* const heights = static_cast<float*>(values);
    try {
      std::vector<float> part(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
      heights_.read(first, size, part.data());
      for (int y = 0; y < size.y; ++y) {
        std::copy_n(part.begin() + static_cast<std::ptrdiff_t>(y) * size.x, size.x,
                    heights + static_cast<std::ptrdiff_t>(y) * block.x);
      }
    } catch (const std::exception& error) {
      fault_ = std::current_exception();
      CPLError(CE_Failure, CPLE_AppDefined, "%s", error.what());
      return CE_Failure;
    }
    return CE_None;
  }

 private:
  const HeightReader& heights_;
  std::exception_ptr& fault_;
};

}  // namespace

/// In-memory dataset of the band.
class WarpedHeights::Source final : public GDALPamDataset {
 public:
  Source(const HeightReader& heights, const RasterHeader& header) {
    nPamFlags |= GPF_NOSAVE;
    nRasterXSize = header.samples.x;
    nRasterYSize = header.samples.y;
    auto transform = header.geotransform;
    GDALPamDataset::SetGeoTransform(transform.data());
    GDALPamDataset::SetSpatialRef(&header.crs);
    SetBand(1, new SourceBand(*this, heights, fault_));
  }

  // An exception cannot pass through GDAL, so it is stored and rethrown to the reader.
  void rethrow_fault() {
    if (fault_) std::rethrow_exception(std::exchange(fault_, nullptr));
  }

 private:
  std::exception_ptr fault_;
};

GDALDatasetUniquePtr warped_view(GDALDataset& source, const std::vector<std::string>& options) {
  CPLStringList words;
  for (const std::string& word : options) words.AddString(word.c_str());
  words.AddString("-of").AddString("VRT");
  const std::unique_ptr<GDALWarpAppOptions, decltype(&GDALWarpAppOptionsFree)> parsed(
      GDALWarpAppOptionsNew(words.List(), nullptr), &GDALWarpAppOptionsFree);
  GDALDatasetH handle = &source;
  return GDALDatasetUniquePtr(
      GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &handle, parsed.get(), nullptr)));
}

WarpedHeights::WarpedHeights(const HeightReader& source, const RasterHeader& header,
                             const std::string& target)
    : source_(std::make_unique<Source>(source, header)) {
  view_ = warped_view(*source_, warp_options(*source_, target));
  if (view_ == nullptr) {
    throw Error("it cannot be reprojected to {}: {}", target, CPLGetLastErrorMsg());
  }
  header_ = read_header(*view_);
  const HeightReader checks_size(*view_, header_.crs, std::nullopt);
}

WarpedHeights::~WarpedHeights() = default;

// Reads whole blocks, because a warp approximates positions over the region requested at once.
void WarpedHeights::read(glm::ivec2 first, glm::ivec2 size, float* heights_m) const {
  GDALRasterBand& band = *view_->GetRasterBand(1);
  glm::ivec2 block;
  band.GetBlockSize(&block.x, &block.y);
  const glm::ivec2 end = first + size;
  for (int y = first.y / block.y; y * block.y < end.y; ++y) {
    for (int x = first.x / block.x; x * block.x < end.x; ++x) {
      CPLErrorReset();
      GDALRasterBlock* values = band.GetLockedBlockRef(x, y);
      source_->rethrow_fault();
      if (values == nullptr || CPLGetLastErrorType() == CE_Failure) {
        if (values != nullptr) values->DropLock();
        throw Error("it cannot be reprojected: {}", CPLGetLastErrorMsg());
      }
      const auto* const from = static_cast<const float*>(values->GetDataRef());
      const glm::ivec2 corner = glm::ivec2(x, y) * block;
      const glm::ivec2 low = glm::max(first, corner);
      const glm::ivec2 high = glm::min(end, corner + block);
      for (int row = low.y; row < high.y; ++row) {
        std::copy_n(
            from + static_cast<std::ptrdiff_t>(row - corner.y) * block.x + low.x - corner.x,
            high.x - low.x,
            heights_m + static_cast<std::ptrdiff_t>(row - first.y) * size.x + low.x - first.x);
      }
      values->DropLock();
    }
  }
}

void check_placed(GDALDataset& dataset, const RasterHeader& header, std::optional<double> nodata) {
  const std::string why = why_not_metric(header.crs);
  if (why.empty() && !header.is_rotated()) return;
  if (!why.empty() && header.crs.IsLocal()) {
    throw Error("{}; redefine it in metres with gdal_translate -a_srs and -a_ullr", why);
  }
  auto words = warp_options(dataset, why.empty() ? "" : fitting_crs(header));
  if (nodata) words.insert(words.end(), {"-srcnodata", fmt::format("{}", *nodata)});
  for (std::string& word : words) word = shell_word(word);
  throw Error("{}; {}run{}", why.empty() ? "its geotransform is rotated or sheared" : why,
              header.has_place_on_a_body() ? "set reproject_to to utm, or " : "",
              command(dataset.GetDescription(), fmt::format("gdalwarp {}", fmt::join(words, " ")),
                      "_metric.tif"));
}

std::unique_ptr<WarpedHeights> reprojected(const HeightReader& raster, const RasterHeader& header,
                                           const std::string& reproject_to) {
  if (!header.has_place_on_a_body()) {
    throw Error(
        "it has no CRS to reproject it from; assign one with gdal_edit.py -a_srs, or remove "
        "reproject_to = '{}'",
        reproject_to);
  }
  const std::string target = reproject_to == "utm" ? fitting_crs(header) : reproject_to;
  OGRSpatialReference crs;
  const char* const no_network[] = {"ALLOW_NETWORK_ACCESS=NO", nullptr};
  if (crs.SetFromUserInput(target.c_str(), no_network) != OGRERR_NONE) {
    throw Error(
        "reproject_to = '{}' is not a CRS known to GDAL; use utm, a code such as EPSG:32631, or a "
        "PROJ string",
        reproject_to);
  }
  if (const std::string why = why_not_metric(crs); !why.empty()) {
    throw Error(
        "reproject_to = '{}' cannot be used: {}; use utm or another projected CRS in metres",
        reproject_to, why);
  }
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (!header.is_rotated() && header.crs.IsSame(&crs) != 0) return nullptr;
  return std::make_unique<WarpedHeights>(raster, header, target);
}

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
    if (raster.IsSame(&world) != 0 || wkt_of(raster) == wkt_of(world)) return std::nullopt;
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
  check_memory(path, size, 4.0 * size.x * size.y);
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
