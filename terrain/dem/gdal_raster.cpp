#include "terrain/dem/gdal_raster.h"

#include <cpl_conv.h>
#include <cpl_string.h>
#include <fmt/ranges.h>
#include <ogr_srs_api.h>
#include <tiffio.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string_view>
#include <system_error>

#include "core/own_folder.h"
#include "terrain/dem/raster_input.h"

namespace groundray {
namespace {

constexpr float hole = std::numeric_limits<float>::quiet_NaN();
constexpr int max_samples_per_side = 1 << 30;
constexpr GIntBig cache_bytes = GIntBig{64} << 20;

// Returns the alpha band beside the band of heights, or null.
GDALRasterBand* alpha_band(GDALDataset& dataset) {
  if (dataset.GetRasterCount() != 2) return nullptr;
  GDALRasterBand* band = dataset.GetRasterBand(2);
  return band->GetColorInterpretation() == GCI_AlphaBand ? band : nullptr;
}

// Returns the band of heights after checking that it can be used.
GDALRasterBand& height_band(GDALDataset& dataset) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  const int bands = dataset.GetRasterCount();
  const int columns = dataset.GetRasterXSize();
  const int rows = dataset.GetRasterYSize();
  const char* name = dataset.GetDescription();
  Violations broken("not a grid of heights");
  const bool is_named = std::string_view(band.GetDescription()) == "elevation";
  broken.unless(
      bands == 1 || alpha_band(dataset) != nullptr || is_named,
      "it has {} bands; it must have one (and optionally alpha), or the first must be named "
      "elevation; select one:{}",
      bands, command(name, "gdal_translate -b 1", "_band1.tif"));
  broken.unless(!GDALDataTypeIsComplex(band.GetRasterDataType()),
                "its samples are complex numbers ({}); heights must be real",
                GDALGetDataTypeName(band.GetRasterDataType()));
  broken.unless(columns >= 2 && rows >= 2, "it has {} x {} samples; a surface needs 2 x 2 or more",
                columns, rows);
  broken.unless(std::max(columns, rows) <= max_samples_per_side,
                "it has {} x {} samples, more than the limit of {} per side; crop it:{}", columns,
                rows, max_samples_per_side,
                command(name, "gdal_translate -srcwin 0 0 32768 32768", "_part.tif"));
  broken.throw_if_any();
  return band;
}

// Returns an EPSG code as a number; 0 if there is none.
int number_of(const char* code) {
  const std::string_view text = code == nullptr ? "" : code;
  int number = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), number);
  return end.ec == std::errc() && end.ptr == text.data() + text.size() ? number : 0;
}

// Returns heights in metres above the same datum. Files identify a datum only by its code.
OGRSpatialReference heights_in_metres(const OGRSpatialReference& crs) {
  const char* const datum = crs.GetAttrValue("VERT_DATUM");
  OGRSpatialReference heights;
  heights.SetVertCS(fmt::format("{} height", datum == nullptr ? "unknown" : datum).c_str(), datum);
  OGRSpatialReference told;  // the CRS's EPSG definition, which contains the datum's code
  const int code = number_of(crs.GetAuthorityCode("VERT_CS"));
  if (code == 0 || told.importFromEPSG(code) != OGRERR_NONE) return heights;
  const int datum_code = number_of(told.GetAuthorityCode("VERT_DATUM"));
  if (datum_code != 0) heights.SetAuthority("VERT_CS|VERT_DATUM", "EPSG", datum_code);
  return heights;
}

// Returns the length of the band's unit of height, m.
double height_unit_m(GDALRasterBand& band, const OGRSpatialReference& crs) {
  std::string unit = band.GetUnitType();
  if (unit.empty()) return crs.IsVertical() ? crs.GetTargetLinearUnits("VERT_CS") : 1;
  for (char& c : unit) c = c == '_' || c == '-' ? ' ' : static_cast<char>(std::tolower(c));
  const auto is = [&](auto... names) { return ((unit == names) || ...); };
  if (is("m", "metre", "metres", "meter", "meters")) return 1;
  if (is("ft", "foot", "feet", "international foot", "international feet")) return 0.3048;
  if (is("us survey foot", "us survey feet", "us ft", "ftus", "foot us", "sft")) {
    return 1200.0 / 3937;
  }
  if (is("cm")) return 0.01;
  if (is("mm")) return 0.001;
  throw Error(
      "its heights are in '{}', not in a supported unit of length (m, ft, us-ft, "
      "cm, mm); set the unit with gdal_edit.py -units",
      band.GetUnitType());
}

// Forwards libtiff's messages to GDAL.
template <CPLErr severity>
void tell_gdal(const char* /*module*/, const char* format, va_list values) {
  CPLErrorV(severity, CPLE_FileIO, format, values);
}

// Whole rows of the caller's window.
struct Strip {
  glm::ivec2 first;
  glm::ivec2 size;
  float* values;
  std::size_t count() const {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  }
};

CPLErr read_strip(GDALRasterBand& band, const Strip& strip, void* values, GDALDataType type) {
  return band.RasterIO(GF_Read, strip.first.x, strip.first.y, strip.size.x, strip.size.y, values,
                       strip.size.x, strip.size.y, type, 0, 0, nullptr);
}

// Sets every sample to NaN where `mask`, if there is one, is zero.
CPLErr cut_holes(GDALRasterBand* mask, const Strip& strip) {
  if (mask == nullptr) return CE_None;
  std::vector<std::uint8_t> values(strip.count());
  const CPLErr result = read_strip(*mask, strip, values.data(), GDT_Byte);
  if (result != CE_None) return result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] == 0) strip.values[i] = hole;
  }
  return CE_None;
}

void refuse_infinite(const Strip& strip) {
  const float* end = strip.values + strip.count();
  const float* infinite =
      std::find_if<const float*>(strip.values, end, [](float z) { return std::isinf(z); });
  if (infinite == end) return;
  const auto index = infinite - strip.values;
  throw Error("the height in column {}, row {} is infinite; if that marks a hole, set nodata to {}",
              strip.first.x + index % strip.size.x, strip.first.y + index / strip.size.x,
              *infinite);
}

// Has GDAL and PROJ read their own files where a package holds them: PROJ reads no database of
// another version.
void use_packed_files() {
  const std::filesystem::path gdal = own_folder() / "gdal";
  const std::filesystem::path proj = own_folder() / "proj";
  if (std::filesystem::exists(gdal)) CPLSetConfigOption("GDAL_DATA", gdal.c_str());
  if (!std::filesystem::exists(proj / "proj.db")) return;
  CPLStringList folders(OSRGetPROJSearchPaths(), TRUE);  // with grids that the user has added
  folders.InsertString(0, proj.c_str());
  OSRSetPROJSearchPaths(folders.List());
}

}  // namespace

void start_gdal() {
  // GDAL's registration is not thread-safe.
  static std::once_flag once;
  std::call_once(once, [] {
    use_packed_files();
    register_drivers();
    // The handlers that GDAL up to 3.6 sets. Later versions keep libtiff's own, which only print,
    // so that an error on closing a file, such as a full disk, would go unnoticed.
    TIFFSetErrorHandler(tell_gdal<CE_Failure>);
    TIFFSetWarningHandler(tell_gdal<CE_Warning>);
    const bool is_chosen = CPLGetConfigOption("GDAL_CACHEMAX", nullptr) != nullptr;
    if (!is_chosen && GDALGetCacheMax64() > cache_bytes) GDALSetCacheMax64(cache_bytes);
  });
}

glm::dvec2 RasterHeader::centre() const {
  const auto& gt = geotransform;
  const glm::dvec2 half = glm::dvec2(samples) / 2.0;
  return {gt[0] + half.x * gt[1] + half.y * gt[2], gt[3] + half.x * gt[4] + half.y * gt[5]};
}

GDALDatasetUniquePtr open_raster(const std::filesystem::path& path) {
  start_gdal();
  GDALDatasetUniquePtr dataset = open_input(path);
  if (dataset->GetRasterCount() == 0) {
    const char* name = CSLFetchNameValue(dataset->GetMetadata("SUBDATASETS"), "SUBDATASET_1_NAME");
    if (name == nullptr) throw Error("it contains no raster");
    throw Error("it contains several rasters; specify one of them instead, such as {}", name);
  }
  return dataset;
}

RasterHeader read_header(GDALDataset& dataset, const char* placing) {
  RasterHeader header;
  header.samples = {dataset.GetRasterXSize(), dataset.GetRasterYSize()};
  auto& gt = header.geotransform;
  if (dataset.GetGeoTransform(gt.data()) != CE_None) {
    if (dataset.GetGCPCount() > 0) {
      throw Error("it is georeferenced by ground control points, not by a geotransform; run{}",
                  command(dataset.GetDescription(), placing, "_placed.tif"));
    }
    // GDAL's default has rows running northwards, which would mirror an image of heights.
    gt = {0, 1, 0, static_cast<double>(header.samples.y), 0, -1};
  }
  const double cell_area = gt[1] * gt[5] - gt[2] * gt[4];
  if (!std::isfinite(gt[0] + gt[3] + cell_area) || cell_area == 0) {
    throw Error(
        "its geotransform [{}] is not finite or has cells without area; correct it with "
        "gdal_edit.py -a_ullr",
        fmt::join(gt, ", "));
  }
  if (const OGRSpatialReference* crs = dataset.GetSpatialRef()) header.crs = *crs;
  return header;
}

std::string name_of(const OGRSpatialReference& crs) {
  if (crs.IsEmpty()) return "local (no CRS)";
  const char* name = crs.GetName();
  const char* authority = crs.GetAuthorityName(nullptr);
  const char* code = crs.GetAuthorityCode(nullptr);
  if (authority == nullptr || code == nullptr) return name == nullptr ? "unnamed" : name;
  return fmt::format("{} ({}:{})", name, authority, code);
}

OGRSpatialReference with_heights_in_metres(const OGRSpatialReference& crs) {
  if (crs.IsCompound() == 0 || crs.GetTargetLinearUnits("VERT_CS") == 1) return crs;
  const OGRSpatialReference heights = heights_in_metres(crs);
  OGRSpatialReference plan = crs, both;
  plan.StripVertical();
  const std::string name = fmt::format("{} + {}", plan.GetName(), heights.GetName());
  both.SetCompoundCS(name.c_str(), &plan, &heights);
  return both;
}

std::string wkt_of(const OGRSpatialReference& crs) {
  if (crs.IsEmpty()) return {};
  char* text = nullptr;
  const char* options[] = {"FORMAT=WKT2_2019", "MULTILINE=NO", nullptr};
  crs.exportToWkt(&text, options);
  const std::unique_ptr<char, decltype(&VSIFree)> owner(text, &VSIFree);
  if (text == nullptr) return {};
  // PROJ before 9.5 gives the datum of a local CRS no name; later versions give it this one.
  std::string wkt = text;
  for (const char* const nameless : {R"(EDATUM[""])", R"(EDATUM["",)"}) {
    const std::size_t at = wkt.find(nameless);
    if (at != std::string::npos) wkt.insert(wkt.find('"', at) + 1, "Unknown engineering datum");
  }
  return wkt;
}

std::string shell_word(const std::string& word) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_./:+-=").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::ranges::all_of(word, is_plain)) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? "'\\''" : std::string(1, c);
  return text + "'";
}

std::string command(const std::filesystem::path& input, const std::string& program,
                    const char* output_ending) {
  const auto folder = input.string().starts_with("/vsi") ? "" : input.parent_path();
  const auto output = folder / (input.stem().string() + output_ending);
  return fmt::format("\n  {} {} {}", program, shell_word(input), shell_word(output));
}

HeightReader::HeightReader(GDALDataset& dataset, const OGRSpatialReference& crs,
                           std::optional<double> nodata, std::optional<double> unit_m)
    : band_(&height_band(dataset)),
      alpha_(alpha_band(dataset)),
      mask_(band_->GetMaskFlags() == GMF_ALL_VALID ? nullptr : band_->GetMaskBand()),
      nodata_(nodata) {
  const double metres = unit_m ? *unit_m : height_unit_m(*band_, crs);
  scale_m_ = band_->GetScale() * metres;
  offset_m_ = band_->GetOffset() * metres;
}

void HeightReader::read(glm::ivec2 first, glm::ivec2 size, float* heights_m) const {
  glm::ivec2 block;
  band_->GetBlockSize(&block.x, &block.y);
  // Whole rows of blocks at a time, so that values and mask come from the same decoded blocks.
  const int rows_at_once = block.y * std::max(1, 256 / block.y);
  const int end = first.y + size.y;
  for (int row = first.y; row < end;) {
    const int next = std::min(end, (row / rows_at_once + 1) * rows_at_once);
    const Strip strip{{first.x, row}, {size.x, next - row}, heights_m};
    CPLErrorReset();
    CPLErr result = read_strip(*band_, strip, strip.values, GDT_Float32);
    if (result == CE_None) result = cut_holes(mask_, strip);
    if (result == CE_None) result = cut_holes(alpha_, strip);
    if (const std::string fault = fault_of_read(result, *band_->GetDataset()); !fault.empty()) {
      throw Error(
          "its samples in columns {} to {}, rows {} to {} cannot all be read: {}; was the file cut "
          "short? Copy it again",
          first.x, first.x + size.x - 1, row, next - 1, fault);
    }
    float* const strip_end = strip.values + strip.count();
    if (nodata_) std::replace(strip.values, strip_end, static_cast<float>(*nodata_), hole);
    if (scale_m_ != 1 || offset_m_ != 0) {
      for (float* z = strip.values; z != strip_end; ++z) {
        *z = static_cast<float>(*z * scale_m_ + offset_m_);
      }
    }
    refuse_infinite(strip);
    heights_m = strip_end;
    row = next;
  }
}

std::string HeightReader::conversion() const {
  int has_declared = 0;
  const double declared = band_->GetNoDataValue(&has_declared);
  return fmt::format("type {} scale_m {} offset_m {} declared {} nodata {} mask {} alpha {}",
                     GDALGetDataTypeName(band_->GetRasterDataType()), scale_m_, offset_m_,
                     has_declared != 0 ? fmt::format("{}", declared) : "none",
                     nodata_ ? fmt::format("{}", *nodata_) : "none", band_->GetMaskFlags(),
                     alpha_ != nullptr);
}

}  // namespace groundray
