#include "terrain/dem_io.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <fmt/ranges.h>
#include <gdal_alg.h>
#include <gdal_priv.h>
#include <gdal_utils.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "core/error.h"

namespace groundray {
namespace {

constexpr std::int64_t max_samples = std::int64_t{1} << 31;
constexpr float hole = std::numeric_limits<float>::quiet_NaN();

// A DEM on its way from file to Dem.
struct Raster {
  int columns = 0;
  int rows = 0;
  std::array<double, 6> geotransform{};  // GDAL's: of corners of pixels
  OGRSpatialReference crs;
  std::vector<float> heights_m;

  bool is_rotated() const { return geotransform[2] != 0 || geotransform[4] != 0; }
  bool has_place_on_a_body() const { return !crs.IsEmpty() && !crs.IsLocal(); }
  glm::dvec2 centre() const {
    const auto& gt = geotransform;
    const glm::dvec2 half(columns / 2.0, rows / 2.0);
    return {gt[0] + half.x * gt[1] + half.y * gt[2], gt[3] + half.x * gt[4] + half.y * gt[5]};
  }
};

GDALDatasetUniquePtr open(const std::filesystem::path& path) {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR));
  if (dataset == nullptr) {
    std::string why = CPLGetLastErrorMsg();
    if (why.ends_with('.')) why.pop_back();
    for (const char* missing : {"No such file", "does not exist"}) {
      if (why.find(missing) != std::string::npos) throw Error("there is no such file");
    }
    throw Error(
        "it cannot be opened as a raster: {}; is it whole, and in a format that GDAL reads?", why);
  }
  if (dataset->GetRasterCount() == 0) {
    const char* name = CSLFetchNameValue(dataset->GetMetadata("SUBDATASETS"), "SUBDATASET_1_NAME");
    if (name == nullptr) throw Error("it holds no raster");
    throw Error("it holds several rasters; name one of them in its place, such as {}", name);
  }
  return dataset;
}

std::string name_of(const OGRSpatialReference& crs) {
  if (crs.IsEmpty()) return "local (no CRS)";
  const char* name = crs.GetName();
  const char* authority = crs.GetAuthorityName(nullptr);
  const char* code = crs.GetAuthorityCode(nullptr);
  if (authority == nullptr || code == nullptr) return name == nullptr ? "unnamed" : name;
  return fmt::format("{} ({}:{})", name, authority, code);
}

std::string wkt_of(const OGRSpatialReference& crs) {
  if (crs.IsEmpty()) return {};
  char* text = nullptr;
  const char* options[] = {"FORMAT=WKT2_2019", "MULTILINE=NO", nullptr};
  crs.exportToWkt(&text, options);
  const std::unique_ptr<char, decltype(&VSIFree)> owner(text, &VSIFree);
  return text == nullptr ? "" : text;
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

// Returns the line that runs a program of GDAL's on the dataset's file and writes beside it, or in
// the working folder if it lies in an archive.
std::string command(GDALDataset& dataset, const std::string& program, const char* output_ending) {
  const std::filesystem::path input = dataset.GetDescription();
  const auto folder = input.string().starts_with("/vsi") ? "" : input.parent_path();
  const auto output = folder / (input.stem().string() + output_ending);
  return fmt::format("\n  {} {} {}", program, shell_word(input), shell_word(output));
}

// Returns the band that marks holes beside the band of heights, if there is one.
GDALRasterBand* alpha_band(GDALDataset& dataset) {
  if (dataset.GetRasterCount() != 2) return nullptr;
  GDALRasterBand* band = dataset.GetRasterBand(2);
  return band->GetColorInterpretation() == GCI_AlphaBand ? band : nullptr;
}

// Returns the band of heights, whose samples are worth reading.
GDALRasterBand& height_band(GDALDataset& dataset) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  const int bands = dataset.GetRasterCount();
  const int columns = dataset.GetRasterXSize();
  const int rows = dataset.GetRasterYSize();
  Violations broken("not a grid of heights");
  broken.unless(bands == 1 || alpha_band(dataset) != nullptr,
                "it has {} bands; there must be one (and may be an alpha band); choose it:{}",
                bands, command(dataset, "gdal_translate -b 1", "_band1.tif"));
  broken.unless(!GDALDataTypeIsComplex(band.GetRasterDataType()),
                "its samples are complex numbers ({}); heights must be real",
                GDALGetDataTypeName(band.GetRasterDataType()));
  broken.unless(columns >= 2 && rows >= 2, "it has {} x {} samples; a surface needs 2 x 2 or more",
                columns, rows);
  broken.unless(std::int64_t{columns} * rows <= max_samples,
                "it has {} x {} samples, more than the {} that fit; cut out a part:{}", columns,
                rows, max_samples,
                command(dataset, "gdal_translate -srcwin 0 0 32768 32768", "_part.tif"));
  broken.throw_if_any();
  return band;
}

Raster read_header(GDALDataset& dataset) {
  Raster raster;
  raster.columns = dataset.GetRasterXSize();
  raster.rows = dataset.GetRasterYSize();
  auto& gt = raster.geotransform;
  if (dataset.GetGeoTransform(gt.data()) != CE_None) {
    if (dataset.GetGCPCount() > 0) {
      throw Error("it is placed by ground control points, not by a geotransform; run{}",
                  command(dataset, "gdalwarp -ot Float32", "_placed.tif"));
    }
    // GDAL's default has rows run northwards, which would mirror a picture of heights.
    gt = {0, 1, 0, static_cast<double>(raster.rows), 0, -1};
  }
  const double cell_area = gt[1] * gt[5] - gt[2] * gt[4];
  if (!std::isfinite(gt[0] + gt[3] + cell_area) || cell_area == 0) {
    throw Error(
        "its geotransform [{}] is not finite or has cells without area; mend it with "
        "gdal_edit.py -a_ullr",
        fmt::join(gt, ", "));
  }
  if (const OGRSpatialReference* crs = dataset.GetSpatialRef()) raster.crs = *crs;
  return raster;
}

// Says why `crs` cannot be W, a plane in metres; empty if it can.
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

// Returns the UTM (near the poles UPS) zone of the raster's centre, or for another body than the
// Earth a transverse Mercator about it, as gdalwarp -t_srs wants it.
std::string fitting_crs(const Raster& raster) {
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
        "its centre ({}, {}) has no longitude and latitude in its CRS, {}; is it placed "
        "rightly?",
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

// Returns the options of gdalwarp that bring `dataset` to `target` (empty: keep its CRS, undo a
// rotation) with square cells about as large as its own, heights unrounded and unshifted, and
// positions off by 1 % of a cell at most.
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
  const std::string cell_m = fmt::format("{}", std::stod(fmt::format("{:.1e}", gt[1])));
  std::vector<std::string> options;
  if (!target.empty()) options = {"-t_srs", target};
  for (const char* word :
       {"-tr", cell_m.c_str(), cell_m.c_str(), "-r", "bilinear", "-et", "0.01", "-ot", "Float32",
        "-dstnodata", "nan", "-novshift", "-wo", "XSCALE=1", "-wo", "YSCALE=1"}) {
    options.emplace_back(word);
  }
  return options;
}

// Refuses a raster whose samples are no grid of metres, with the command that makes one of it.
void check_placed(GDALDataset& dataset, const Raster& raster, std::optional<double> nodata) {
  const std::string why = why_not_metric(raster.crs);
  if (why.empty() && !raster.is_rotated()) return;
  if (!why.empty() && raster.crs.IsLocal()) {
    throw Error("{}; state it anew with gdal_translate -a_srs and -a_ullr, in metres", why);
  }
  auto words = warp_options(dataset, why.empty() ? "" : fitting_crs(raster));
  if (nodata) words.insert(words.end(), {"-srcnodata", fmt::format("{}", *nodata)});
  for (std::string& word : words) word = shell_word(word);
  throw Error("{}; {}run{}", why.empty() ? "its geotransform is rotated or sheared" : why,
              raster.has_place_on_a_body() ? "set reproject_to to utm, or " : "",
              command(dataset, fmt::format("gdalwarp {}", fmt::join(words, " ")), "_metric.tif"));
}

// Returns the length of the band's unit of height.
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
      "its heights are in '{}', not in a unit of length known here (m, ft, us-ft, "
      "cm, mm); say which with gdal_edit.py -units",
      band.GetUnitType());
}

// Makes a hole of every sample where `mask` is zero.
CPLErr cut_holes(GDALRasterBand& mask, std::vector<float>& heights) {
  constexpr int rows_at_once = 256;
  const int columns = mask.GetXSize();
  std::vector<std::uint8_t> values(static_cast<std::size_t>(columns) * rows_at_once);
  auto height = heights.begin();
  for (int row = 0; row < mask.GetYSize(); row += rows_at_once) {
    const int rows = std::min(rows_at_once, mask.GetYSize() - row);
    const CPLErr result = mask.RasterIO(GF_Read, 0, row, columns, rows, values.data(), columns,
                                        rows, GDT_Byte, 0, 0, nullptr);
    if (result != CE_None) return result;
    const auto end = height + static_cast<std::ptrdiff_t>(rows) * columns;
    for (auto value = values.begin(); height != end; ++height, ++value) {
      if (*value == 0) *height = hole;
    }
  }
  return CE_None;
}

// Reads all stored values; holes are what GDAL's mask (declared nodata, a mask in the file or
// beside it) or the alpha band hides.
std::vector<float> read_values(GDALRasterBand& band) {
  const int columns = band.GetXSize();
  const int rows = band.GetYSize();
  std::vector<float> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  CPLErrorReset();
  CPLErr result = band.RasterIO(GF_Read, 0, 0, columns, rows, values.data(), columns, rows,
                                GDT_Float32, 0, 0, nullptr);
  const bool is_masked = band.GetMaskFlags() != GMF_ALL_VALID;
  if (result == CE_None && is_masked) result = cut_holes(*band.GetMaskBand(), values);
  GDALRasterBand* alpha = alpha_band(*band.GetDataset());
  if (result == CE_None && alpha != nullptr) result = cut_holes(*alpha, values);
  // Some drivers fill in what they could not read and report an error, but return success.
  if (result != CE_None || CPLGetLastErrorType() == CE_Failure) {
    throw Error("its samples cannot all be read: {}; was the file cut short? Copy it again",
                CPLGetLastErrorMsg());
  }
  return values;
}

std::vector<float> read_heights(GDALRasterBand& band, std::optional<double> nodata, double unit_m) {
  std::vector<float> heights = read_values(band);
  if (nodata) std::ranges::replace(heights, static_cast<float>(*nodata), hole);
  const double scale = band.GetScale() * unit_m;
  const double offset_m = band.GetOffset() * unit_m;
  if (scale != 1 || offset_m != 0) {
    for (float& height : heights) height = static_cast<float>(height * scale + offset_m);
  }
  return heights;
}

void check_heights(const Raster& raster) {
  const auto& heights_m = raster.heights_m;
  const auto infinite = std::ranges::find_if(heights_m, [](float z) { return std::isinf(z); });
  if (infinite != heights_m.end()) {
    const auto index = infinite - heights_m.begin();
    throw Error("the height in column {}, row {} is infinite; if that means none, set nodata to {}",
                index % raster.columns, index / raster.columns, *infinite);
  }
  if (std::ranges::all_of(heights_m, [](float z) { return std::isnan(z); })) {
    throw Error("none of its {} x {} samples has a height, all are nodata; is that value right?",
                raster.columns, raster.rows);
  }
}

// Returns a dataset over the raster's samples, which must outlive it.
GDALDatasetUniquePtr dataset_over(Raster& raster) {
  GDALDriver& memory = *GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDatasetUniquePtr dataset(
      memory.Create("", raster.columns, raster.rows, 0, GDT_Float32, nullptr));
  CPLStringList band;
  band.AddNameValue("DATAPOINTER", fmt::format("{}", fmt::ptr(raster.heights_m.data())).c_str());
  dataset->AddBand(GDT_Float32, band.List());
  dataset->SetGeoTransform(raster.geotransform.data());
  dataset->SetSpatialRef(&raster.crs);
  dataset->GetRasterBand(1)->SetNoDataValue(hole);
  return dataset;
}

Raster warped(Raster raster, const std::string& target) {
  const GDALDatasetUniquePtr source = dataset_over(raster);
  CPLStringList words;
  for (const auto& word : warp_options(*source, target)) words.AddString(word.c_str());
  words.AddString("-of").AddString("VRT");
  const std::unique_ptr<GDALWarpAppOptions, decltype(&GDALWarpAppOptionsFree)> options(
      GDALWarpAppOptionsNew(words.List(), nullptr), &GDALWarpAppOptionsFree);
  GDALDatasetH handle = source.get();
  const GDALDatasetUniquePtr view(
      GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &handle, options.get(), nullptr)));
  if (view == nullptr) {
    throw Error("it cannot be reprojected to {}: {}", target, CPLGetLastErrorMsg());
  }
  GDALRasterBand& band = height_band(*view);
  Raster result = read_header(*view);
  result.heights_m = read_heights(band, std::nullopt, 1);
  return result;
}

Raster reprojected(Raster raster, const std::string& reproject_to) {
  if (!raster.has_place_on_a_body()) {
    throw Error(
        "it names no CRS to reproject it from; name it with gdal_edit.py -a_srs, or leave "
        "reproject_to = '{}' out",
        reproject_to);
  }
  const std::string target = reproject_to == "utm" ? fitting_crs(raster) : reproject_to;
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(target.c_str()) != OGRERR_NONE) {
    throw Error(
        "reproject_to = '{}' is no CRS that GDAL knows ({}); write utm, a code such as "
        "EPSG:32631, or a PROJ string",
        reproject_to, CPLGetLastErrorMsg());
  }
  if (const std::string why = why_not_metric(crs); !why.empty()) {
    throw Error("reproject_to = '{}' will not do: {}; write utm or another projected CRS in metres",
                reproject_to, why);
  }
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const bool is_there = !raster.is_rotated() && raster.crs.IsSame(&crs) != 0;
  return is_there ? std::move(raster) : warped(std::move(raster), target);
}

Raster read(const std::filesystem::path& path, const DemOptions& options) {
  const GDALDatasetUniquePtr dataset = open(path);
  GDALRasterBand& band = height_band(*dataset);
  Raster raster = read_header(*dataset);
  if (options.reproject_to.empty()) check_placed(*dataset, raster, options.nodata);
  raster.heights_m = read_heights(band, options.nodata, height_unit_m(band, raster.crs));
  check_heights(raster);
  if (!options.reproject_to.empty()) raster = reprojected(std::move(raster), options.reproject_to);
  return raster;
}

Dem to_dem(Raster raster) {
  const auto& gt = raster.geotransform;
  const glm::dvec2 origin_w_m = glm::round(raster.centre());
  const glm::dvec2 step_m(gt[1], gt[5]);
  // First the difference of two near numbers, which is exact.
  const glm::dvec2 origin_m = (glm::dvec2(gt[0], gt[3]) - origin_w_m) + 0.5 * step_m;
  return {HeightGrid({raster.columns, raster.rows}, origin_m, step_m, std::move(raster.heights_m)),
          glm::dvec3(origin_w_m, 0), wkt_of(raster.crs), name_of(raster.crs)};
}

// Calls `work` with GDAL's messages kept from stderr, and has errors say which file they are about.
auto about(const std::filesystem::path& path, const auto& work) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  try {
    return work();
  } catch (const Error& error) {
    throw Error("{}: {}", path.string(), error.what());
  }
}

}  // namespace

Dem load_dem(const std::filesystem::path& path, const DemOptions& options) {
  return about(path, [&] { return to_dem(read(path, options)); });
}

DemInfo inspect_dem(const std::filesystem::path& path) {
  return about(path, [&] {
    const GDALDatasetUniquePtr dataset = open(path);
    const Raster header = read_header(*dataset);
    const GDALDataType type = dataset->GetRasterBand(1)->GetRasterDataType();
    return DemInfo{header.columns, header.rows, dataset->GetDriverName(), GDALGetDataTypeName(type),
                   name_of(header.crs)};
  });
}

}  // namespace groundray
