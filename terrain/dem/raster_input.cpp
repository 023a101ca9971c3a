#include "terrain/dem/raster_input.h"

#include <cpl_conv.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <cpl_vsi_error.h>
#include <cpl_vsi_virtual.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <memory>
#include <regex>
#include <string_view>
#include <utility>
#include <vector>

#include "core/io/memory.h"
#include "core/io/open_file.h"
#include "core/near_names.h"
#include "terrain/dem/local_files.h"

namespace groundray {
namespace {

// Formats of DEMs and photos that refer to no file in another folder, besides VRT, which check_vrt
// reads first.
constexpr std::array input_drivers{"GTiff",   "VRT",     "HFA",  "AAIGrid", "DTED", "PNG",
                                   "SRTMHGT", "USGSDEM", "EHdr", "ENVI",    "JPEG", "XYZ"};
constexpr std::array local_systems{"/vsimem/", "/vsizip/", "/vsigzip/", "/vsitar/", "/vsisubfile/"};
// Those that are open if the network is.
constexpr std::array remote_systems{"/vsicurl/", "/vsis3/"};
constexpr const char* more_drivers = "GROUNDRAY_RASTER_DRIVERS";
constexpr const char* network = "GROUNDRAY_NETWORK";
constexpr std::size_t most_name_bytes = 4096;
constexpr double most_block_bytes = 1 << 30;

// Returns the permitted drivers: input_drivers and those that the environment adds.
CPLStringList permitted_drivers() {
  const char* more = std::getenv(more_drivers);
  CPLStringList names(CSLTokenizeString2(more == nullptr ? "" : more, ", ", 0), TRUE);
  for (const char* name : input_drivers) names.AddString(name);
  return names;
}

// Returns true if rasters may be read from servers, which the environment decides at the start.
bool is_network_open() {
  static const bool is_open = [] {
    const char* given = std::getenv(network);
    const std::string_view value = given == nullptr ? "" : given;
    if (value == "1") return true;
    if (value.empty() || value == "0") return false;
    throw Error("the environment variable {} must be 1 (rasters are read from servers) or 0",
                network);
  }();
  return is_open;
}

bool is_open_system(std::string_view path) {
  const auto begins_path = [&](const char* prefix) { return path.starts_with(prefix); };
  return std::ranges::any_of(local_systems, begins_path) ||
         (is_network_open() && std::ranges::any_of(remote_systems, begins_path));
}

bool is_remote(const std::string& name) {
  return is_network_open() && std::ranges::any_of(remote_systems, [&](const char* prefix) {
           return name.find(prefix) != std::string::npos;
         });
}

// Returns why a server does not give the file; empty if it gives its first byte.
std::string answer_of_server(const std::string& file) {
  VSICurlClearCache();  // it remembers that there is no file, but not why
  VSIErrorReset();
  CPLErrorReset();
  const std::unique_ptr<VSILFILE, decltype(&VSIFCloseL)> open(VSIFOpenExL(file.c_str(), "rb", TRUE),
                                                              &VSIFCloseL);
  char first = 0;
  if (open && VSIFReadL(&first, 1, 1, open.get()) == 1) return "";
  std::string answer = *VSIGetLastErrorMsg() ? VSIGetLastErrorMsg() : CPLGetLastErrorMsg();
  answer.resize(std::min({answer.find('\n'), answer.find(". Retrying"), answer.size()}));
  return fmt::format("the server does not give it{}", answer.empty() ? "" : ": " + answer);
}

// Sets limits of time for servers, unless the environment sets others.
void limit_waiting() {
  constexpr std::array<std::pair<const char*, const char*>, 4> limits{
      {{"GDAL_HTTP_CONNECTTIMEOUT", "10"},
       {"GDAL_HTTP_TIMEOUT", "60"},
       {"GDAL_HTTP_MAX_RETRY", "5"},
       {"GDAL_HTTP_RETRY_DELAY", "1"}}};
  for (const auto& [key, value] : limits)
    if (CPLGetConfigOption(key, nullptr) == nullptr) CPLSetConfigOption(key, value);
}

void* refuse_file(void* /*user*/, const char* name, const char* /*access*/) {
  CPLError(CE_Failure, CPLE_OpenFailed, "%s is not a local file", name);
  return nullptr;
}

void close_file_systems() {
  const std::unique_ptr<VSIFilesystemPluginCallbacksStruct,
                        decltype(&VSIFreeFilesystemPluginCallbacksStruct)>
      refusal(VSIAllocFilesystemPluginCallbacksStruct(), &VSIFreeFilesystemPluginCallbacksStruct);
  refusal->open = refuse_file;
  CPLStringList prefixes(VSIGetFileSystemsPrefixes(), TRUE);
  prefixes.AddString("/vsicurl?");  // the list omits it
  // GDAL forgets the handlers that it replaces. They may be in use, so they are kept until the end.
  static auto& replaced = *new std::vector<VSIFilesystemHandler*>;
  for (int i = 0; i < prefixes.size(); ++i) {
    if (is_open_system(prefixes[i])) continue;
    replaced.push_back(VSIFileManager::GetHandler(prefixes[i]));
    VSIInstallPluginHandler(prefixes[i], refusal.get());
  }
}

// The VRT driver's own functions, set once, by register_drivers.
int (*is_vrt)(GDALOpenInfo*) = nullptr;
GDALDataset* (*open_any_vrt)(GDALOpenInfo*) = nullptr;

GDALDataset* open_checked_vrt(GDALOpenInfo* info) {
  if (is_vrt(info) == 0) return nullptr;
  try {
    // Overviews and masks beside a raster are opened by GDAL alone, uncounted.
    const std::string ending = std::filesystem::path(info->pszFilename).extension().string();
    if (EQUAL(ending.c_str(), ".ovr") || EQUAL(ending.c_str(), ".msk"))
      throw Error("{}: overviews and masks must not be VRTs", info->pszFilename);
    check_vrt(info->pszFilename);
  } catch (const std::exception& error) {
    CPLError(CE_Failure, CPLE_AppDefined, "%s", error.what());
    return nullptr;
  }
  return open_any_vrt(info);
}

// Removes all drivers but those that are permitted or write groundray's files.
void remove_drivers(GDALDriverManager& drivers) {
  const CPLStringList permitted = permitted_drivers();
  for (int i = drivers.GetDriverCount() - 1; i >= 0; --i) {
    GDALDriver* const driver = drivers.GetDriver(i);
    const std::string_view name = driver->GetDescription();
    if (permitted.FindString(driver->GetDescription()) >= 0 || name == "MEM" || name == "COG") {
      continue;
    }
    drivers.DeregisterDriver(driver);
    delete driver;
  }
  drivers.GetDriverByName("MEM")->pfnOpen = nullptr;  // it opens names that are addresses
  GDALDriver& vrt = *drivers.GetDriverByName("VRT");
  is_vrt = vrt.pfnIdentify;
  open_any_vrt = vrt.pfnOpen;
  vrt.pfnOpen = open_checked_vrt;
}

void check_blocks(GDALDataset& dataset) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  glm::ivec2 block;
  band.GetBlockSize(&block.x, &block.y);
  const double bytes = 1.0 * block.x * block.y * GDALGetDataTypeSizeBytes(band.GetRasterDataType());
  if (bytes <= most_block_bytes) return;
  throw Error(
      "its blocks of {} x {} samples take {:.1f} GiB each, more than the limit of {:.0f} GiB; "
      "store it in tiles:{}",
      block.x, block.y, bytes / 0x1p30, most_block_bytes / 0x1p30,
      command(dataset.GetDescription(), "gdal_translate -co TILED=YES", "_tiled.tif"));
}

// Some formats name files that hold their samples or overviews, such as Erdas Imagine's .ige. A VRT
// may read any raster, and check_vrt has read it.
void check_files_beside(GDALDataset& dataset, const std::string& file) {
  const CPLStringList files(dataset.GetFileList());
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  for (int i = 0; i < files.size(); ++i) {
    const std::filesystem::path other(files[i]);
    const bool is_metadata =
        std::string_view(files[i]).ends_with(".aux.xml");  // GDAL_PAM_PROXY_DIR
    if (is_metadata || other.lexically_normal().parent_path() == folder.lexically_normal())
      continue;
    throw Error("it refers to {}, which is not in its folder", other.string());
  }
}

double samples_of(GDALDataset& dataset) {
  return 1.0 * dataset.GetRasterXSize() * dataset.GetRasterYSize();
}

// Returns the bytes of all bands, in whole blocks if `in_blocks`.
double bytes_of(GDALDataset& dataset, bool in_blocks) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  double samples = samples_of(dataset);
  if (in_blocks) {
    glm::ivec2 block;
    band.GetBlockSize(&block.x, &block.y);
    samples = std::ceil(1.0 * dataset.GetRasterXSize() / block.x) * block.x *
              std::ceil(1.0 * dataset.GetRasterYSize() / block.y) * block.y;
  }
  const char* bits = band.GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
  const double bytes = bits != nullptr ? CPLAtof(bits) / 8
                                       : 1.0 * GDALGetDataTypeSizeBytes(band.GetRasterDataType());
  return samples * dataset.GetRasterCount() * bytes;
}

// GDAL takes what a file of samples lacks for heights of 0.
void check_raw_size(const std::string& file, double bytes) {
  constexpr std::string_view packed = "\x1f\x8b";
  VSIStatBufL state;
  if (VSIStatL(file.c_str(), &state) != 0 || static_cast<double>(state.st_size) >= bytes) return;
  std::string begin(packed.size(), '\0');
  open_stream(file).read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (begin == packed) return;
  throw Error("its samples take {:.0f} bytes by its header, but {} has {}; is it complete?", bytes,
              std::filesystem::path(file).filename().string(), state.st_size);
}

// Erdas Imagine keeps the samples of large rasters beside the .img, in an .ige, uncompressed.
void check_spill_file(GDALDataset& dataset) {
  const CPLStringList files(dataset.GetFileList());
  for (int i = 0; i < files.size(); ++i) {
    if (!std::string_view(files[i]).ends_with(".ige")) continue;
    constexpr double header_bytes = 26;
    check_raw_size(files[i], header_bytes + bytes_of(dataset, true));
  }
}

// GDAL searches all lines for each row, and reads what they lack as holes.
void check_lines(GDALDataset& dataset, const std::string& file) {
  constexpr double most_samples_per_byte = 64;
  VSIStatBufL state;
  if (VSIStatL(file.c_str(), &state) != 0) return;
  const double samples = samples_of(dataset), bytes = static_cast<double>(state.st_size);
  if (samples <= most_samples_per_byte * bytes && dataset.GetRasterYSize() <= bytes) return;
  throw Error(
      "its {} bytes of text are {} x {} samples, nearly all of them missing; does a line lie far "
      "from the others?",
      state.st_size, dataset.GetRasterXSize(), dataset.GetRasterYSize());
}

// Returns why GDAL opened no raster, without what is meant for its developers.
std::string why_not_opened(const std::string& name) {
  std::string why = CPLGetLastErrorMsg();
  if (why.find("VSIFReadL") != std::string::npos) return "it ends too early";
  if (why.ends_with('.')) why.pop_back();
  // GDAL begins with the file's name, sometimes twice; our messages begin with it, too.
  while (why.starts_with(name + ":"))
    why.erase(0, std::min(why.find_first_not_of(' ', name.size() + 1), why.size()));
  return why;
}

}  // namespace

void register_drivers() {
  const bool is_network_wanted = is_network_open();  // throws before anything is registered
  GDALDriverManager& drivers = *GetGDALDriverManager();
  const bool is_first = drivers.GetDriverCount() == 0;
  CPLSetConfigOption("GDAL_SKIP", "");  // or those that are needed may be missing
  GDALAllRegister();
  CPLSetConfigOption("GDAL_VRT_ENABLE_PYTHON", "NO");
  CPLSetConfigOption("CPL_VSIL_GZIP_WRITE_PROPERTIES", "NO");  // a file beside the archive
  if (is_network_wanted) limit_waiting();
  if (!is_first) return;
  remove_drivers(drivers);
  close_file_systems();
  refuse_pipes_to_gdal();
}

std::string checked_file(const std::string& name) {
  static const std::regex subdataset(
      R"re(GTIFF_DIR:(?:off:)?\d+:(.+)|[A-Za-z0-9_]+:"([^"]+)".*)re");
  static const std::regex system(R"re(/vsi[a-z][a-z0-9_]*(?=[/\\?]))re");
  // Regular expressions recurse once for each character.
  if (name.size() > most_name_bytes) {
    throw Error("its name has {} characters, more than the limit of {}", name.size(),
                most_name_bytes);
  }
  std::smatch parts;
  std::string file = name;
  if (std::regex_match(name, parts, subdataset)) file = parts[1].matched ? parts[1] : parts[2];
  for (std::sregex_iterator at(file.begin(), file.end(), system), end; at != end; ++at) {
    if (is_open_system(at->str() + "/")) continue;
    if (std::ranges::find(remote_systems, at->str() + "/") == remote_systems.end())
      throw Error("{} is not read: rasters must be local files; download it first", at->str());
    throw Error(
        "{} is not read: rasters must be local files, unless --network or {}=1 permits servers",
        at->str(), network);
  }
  VSIStatBufL state;
  if (VSIStatExL(file.c_str(), &state, VSI_STAT_EXISTS_FLAG | VSI_STAT_NATURE_FLAG) != 0) {
    if (is_remote(file)) throw Error("{}", answer_of_server(file));
    throw Error("{}", file.starts_with("/vsi") ? "there is no such file" : why_no_file(file));
  }
  if (!VSI_ISREG(state.st_mode)) {
    throw Error("it cannot be opened as a raster: {}",
                VSI_ISDIR(state.st_mode) ? why_no_file(file) : "it is not a regular file");
  }
  return file;
}

std::string checked_driver(const std::string& name) {
  const CPLStringList drivers = permitted_drivers();
  GDALDriverH driver = GDALIdentifyDriverEx(name.c_str(), GDAL_OF_RASTER, drivers.List(), nullptr);
  if (driver != nullptr) return GDALGetDriverShortName(driver);
  if (const std::string why = is_remote(name) ? answer_of_server(name) : ""; !why.empty())
    throw Error("{}", why);
  const std::string ending = std::filesystem::path(name).extension().string();
  for (const char* other : {".ply", ".pcd", ".las", ".laz", ".npy", ".npz", ".bin", ".e57", ".obj",
                            ".stl", ".glb", ".gltf"}) {
    if (ending != other) continue;
    throw Error(
        "it is no raster, but a mesh or points by its name; `groundray reconstruct dem` makes a "
        "raster of scans");
  }
  throw Error(
      "it cannot be opened as a raster: it is in none of the formats {}; is it complete? Convert "
      "other formats, or name their GDAL driver in {} if you trust the file:{}",
      fmt::join(input_drivers, ", "), more_drivers,
      command(name, "gdal_translate", "_converted.tif"));
}

GDALDatasetUniquePtr open_input(const std::string& name) {
  const std::string file = checked_file(name), driver = checked_driver(name);
  if (driver == "VRT") check_vrt(name);
  CPLErrorReset();
  GDALDatasetUniquePtr dataset(GDALDataset::Open(
      name.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR, permitted_drivers().List()));
  if (dataset == nullptr) {
    throw Error("it cannot be opened as a raster: {}; is it complete?", why_not_opened(name));
  }
  if (driver != "VRT") check_files_beside(*dataset, file);
  if (dataset->GetRasterCount() == 0) return dataset;
  check_blocks(*dataset);
  if (driver == "ENVI" || driver == "EHdr") check_raw_size(file, bytes_of(*dataset, false));
  if (driver == "HFA") check_spill_file(*dataset);
  if (driver == "XYZ") check_lines(*dataset, file);
  return dataset;
}

std::string fault_of_read(CPLErr result, GDALDataset& dataset) {
  std::string why = CPLGetLastErrorMsg();
  const bool is_cut = why.find("Premature end") != std::string::npos;
  if (result == CE_None && CPLGetLastErrorType() != CE_Failure && !is_cut) return {};
  // "east.tif, band 1: IReadBlock failed at X offset 0, Y offset 1: TIFFReadEncodedTile() failed."
  static const std::regex place(
      R"re(^(.*), band \d+: IReadBlock failed at X offset \d+, Y offset \d+(: )?)re");
  std::string file;
  if (std::smatch parts; why.size() < most_name_bytes && std::regex_search(why, parts, place)) {
    file = parts[1];
    why = parts.suffix();
  }
  why.resize(std::min(why.find(" (this warning"), why.size()));
  while (why.ends_with('.')) why.pop_back();
  if (why.empty() || why.ends_with("() failed")) why = "a block is incomplete or damaged";
  // Of a VRT, the file is one of its sources.
  const std::filesystem::path own = dataset.GetDescription();
  return file.empty() || file == own || file == own.filename() ? why : file + ": " + why;
}

void check_memory(const std::filesystem::path& path, glm::ivec2 size, double bytes) {
  const double available = available_memory_bytes();
  if (bytes <= available) return;
  throw Error(
      "its {} x {} samples take {:.1f} GiB of memory, but {:.1f} GiB are available; crop it:{}",
      size.x, size.y, bytes / 0x1p30, available / 0x1p30,
      command(path, "gdal_translate -srcwin 0 0 8192 8192", "_part.tif"));
}

}  // namespace groundray
