#include "terrain/lod/certificate_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/folder_names.h"
#include "core/io/file_io.h"
#include "core/io/open_file.h"
#include "core/io/text_lines.h"
#include "terrain/dem/byte_hash.h"

namespace groundray {
namespace {

constexpr const char* summary_name = "certificate.txt";
constexpr int heights_tile = 128;
constexpr int nodes_tile = 64;

// Returns the outer corner, in W, of a raster whose first cell, of size `cell_m`, is centred on
// `centre` (D).
glm::dvec2 corner_w_m(const DemHeader& dem, glm::dvec2 centre, glm::dvec2 cell_m) {
  return glm::dvec2(dem.origin_w_m) + (centre - 0.5 * cell_m);
}

// Returns a line with the length of a file and a hash of its bytes: those at both ends, where a
// TIFF keeps its directories, and some in between. Empty if the file cannot be read.
std::string raster_text(const std::filesystem::path& folder, const std::string& name) {
  constexpr std::int64_t end_bytes = 1 << 16;
  constexpr std::int64_t piece_bytes = 1 << 12;
  constexpr std::int64_t pieces = 64;
  std::ifstream file = open_stream(folder / name);
  file.seekg(0, std::ios::end);
  const std::int64_t size = file.tellg();
  std::string bytes;
  const auto add = [&](std::int64_t from, std::int64_t count) {
    const std::size_t before = bytes.size();
    bytes.resize(before + static_cast<std::size_t>(std::min(count, size - from)));
    file.seekg(from);
    file.read(bytes.data() + before, static_cast<std::streamsize>(bytes.size() - before));
  };
  if (!file) return {};
  add(0, end_bytes);
  for (std::int64_t i = 1; i < pieces; ++i) add(size / pieces * i, piece_bytes);
  add(std::max<std::int64_t>(0, size - end_bytes), end_bytes);
  if (!file) return {};
  return fmt::format("raster {} {} bytes, hash {:016x}\n", name, size, byte_hash(bytes));
}

std::string preamble(const std::string& key) { return "groundray certificate 1\n" + key; }

std::string level_text(std::size_t level, const LevelSummary& of) {
  return fmt::format(
      "level {} nodes {} mixed {} empty {} max_key_m {} max_deviation_m {} mean_deviation_m {}\n",
      level, of.nodes, of.mixed, of.empty, of.max_key_m, of.max_deviation_m, of.mean_deviation_m);
}

std::string node_text(const NodeLevel& node) {
  return fmt::format("node {} {} {} {} {}\n", node.key_m[0], node.deviation_m[0], node.full_m[0],
                     node.low_m[0], node.high_m[0]);
}

// Parses a word as a number; returns false if it is not one.
template <typename T>
bool read_number(const std::vector<std::string_view>& words, std::size_t index, T& value) {
  const auto number = index < words.size() ? number_of<T>(words[index]) : std::nullopt;
  value = number.value_or(T{});
  return number.has_value();
}

bool read_level(std::string_view line, LevelSummary& level) {
  const auto words = words_of(line);
  return read_number(words, 3, level.nodes) && read_number(words, 5, level.mixed) &&
         read_number(words, 7, level.empty) && read_number(words, 9, level.max_key_m) &&
         read_number(words, 11, level.max_deviation_m) &&
         read_number(words, 13, level.mean_deviation_m);
}

bool read_node(std::string_view line, NodeLevel& node) {
  const auto words = words_of(line);
  node.size = {1, 1};
  std::size_t index = 0;
  for (auto* values : {&node.key_m, &node.deviation_m, &node.full_m, &node.low_m, &node.high_m}) {
    if (!read_number(words, ++index, values->emplace_back())) return false;
  }
  return true;
}

bool is_of_a_certificate(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  for (const std::string_view ending : {".aux.xml", ".part"}) {
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  }
  return name == summary_name || name == nodes_name ||
         (name.starts_with("heights_") && name.ends_with(".tif"));
}

// Deletes the files of a certificate; returns true if the folder is then empty.
bool empty_folder(const std::filesystem::path& folder) {
  std::error_code fault;
  bool is_empty = true;
  for (const std::string& name : names_in(folder, fault))
    is_empty &= is_of_a_certificate(name) && std::filesystem::remove(folder / name, fault);
  return is_empty && !fault;
}

bool has_alien_files(const std::filesystem::path& folder) {
  std::error_code fault;
  const auto names = names_in(folder, fault);
  return !std::ranges::all_of(names, is_of_a_certificate);
}

}  // namespace

int raster_levels(const Lattice& lattice) {
  int levels = 1;
  while (lattice.nodes(levels) != glm::ivec2(1)) ++levels;
  return levels;
}

std::vector<std::string> raster_names(const Lattice& lattice) {
  std::vector<std::string> names{nodes_name};
  for (int level = 1; level <= lattice.top_level(); ++level) names.push_back(heights_name(level));
  return names;
}

TiffSpec nodes_spec(const Lattice& lattice, const DemHeader& dem) {
  const glm::dvec2 cell_m = dem.step_m * static_cast<double>(lattice.block_cells);
  return {.size = lattice.nodes(0),
          .overviews = raster_levels(lattice) - 1,
          .bands = {"key_m", "deviation_m", "full_m", "low_m", "high_m"},
          .tile = nodes_tile,
          .corner_w_m = glm::dvec2(dem.origin_w_m) + dem.origin_m,
          .cell_m = cell_m,
          .crs_wkt = dem.crs_wkt};
}

std::string heights_name(int level) { return fmt::format("heights_{:02}.tif", level); }

TiffSpec heights_spec(const Lattice& lattice, const DemHeader& dem, int level) {
  const glm::dvec2 cell_m = dem.step_m * static_cast<double>(1 << level);
  return {.size = lattice.points(level),
          .bands = {"height_m"},
          .tile = heights_tile,
          .corner_w_m = corner_w_m(dem, dem.origin_m, cell_m),
          .cell_m = cell_m,
          .crs_wkt = dem.crs_wkt};
}

void write_summary(const std::filesystem::path& folder, const std::string& key,
                   const Lattice& lattice, const CertificateSummary& summary) {
  std::string text = preamble(key);
  for (std::size_t level = 0; level < summary.levels.size(); ++level) {
    text += level_text(level, summary.levels[level]);
  }
  for (const NodeLevel& node : summary.single_nodes) text += node_text(node);
  for (const std::string& name : raster_names(lattice)) text += raster_text(folder, name);
  text += fmt::format("end {:016x}\n", byte_hash(text));
  write_text(folder / summary_name, text);
}

std::optional<CertificateSummary> read_summary(const std::filesystem::path& folder,
                                               const std::string& key, const Lattice& lattice) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder / summary_name, ignored)) return std::nullopt;
  std::string text;
  try {
    text = read_text(folder / summary_name);
  } catch (const Error&) {
    return std::nullopt;
  }
  const std::size_t body = preamble(key).size();
  const std::size_t end = text.rfind("end ");
  if (!text.starts_with(preamble(key)) || end == std::string::npos || end < body ||
      text.substr(end) != fmt::format("end {:016x}\n", byte_hash(text.substr(0, end)))) {
    return std::nullopt;
  }
  CertificateSummary summary;
  const int levels = lattice.top_level() + 1;
  summary.levels.resize(static_cast<std::size_t>(levels));
  summary.single_nodes.resize(static_cast<std::size_t>(levels - raster_levels(lattice)));
  TextLines lines(std::string_view(text).substr(body, end - body));
  bool is_whole = true;
  for (auto& level : summary.levels) is_whole &= read_level(lines.next().value_or(""), level);
  for (auto& node : summary.single_nodes) is_whole &= read_node(lines.next().value_or(""), node);
  std::string rasters;
  for (const std::string& name : raster_names(lattice)) rasters += raster_text(folder, name);
  if (!is_whole || lines.rest() != rasters) return std::nullopt;
  return summary;
}

std::vector<std::filesystem::path> certificate_folders(const DemFile& dem) {
  std::vector<std::filesystem::path> folders;
  const DemOptions& options = dem.options();
  const std::string wishes =
      options.nodata || !options.reproject_to.empty()
          ? fmt::format("{} {}", options.nodata ? fmt::format("{}", *options.nodata) : "",
                        options.reproject_to)
          : "";
  std::error_code ignored;
  const bool is_file = std::filesystem::exists(dem.path(), ignored);
  const auto full = is_file ? std::filesystem::absolute(dem.path()) : dem.path();
  if (is_file) {
    const std::string variant = wishes.empty() ? "" : fmt::format(".{:016x}", byte_hash(wishes));
    folders.emplace_back(full.string() + variant + ".groundray");
  }
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  std::filesystem::path base;
  if (cache != nullptr && cache[0] == '/') {
    base = cache;
  } else if (home != nullptr && home[0] == '/') {
    base = std::filesystem::path(home) / ".cache";
  }
  if (!base.empty()) {
    const std::string what = full.lexically_normal().string() + "\n" + wishes;
    folders.push_back(base / "groundray" / fmt::format("{:016x}", byte_hash(what)));
  }
  return folders;
}

std::optional<FolderInMaking> FolderInMaking::begin(const std::filesystem::path& place) {
  std::error_code ignored;
  std::filesystem::create_directories(place.parent_path(), ignored);
  // A link is not followed: nothing elsewhere is deleted.
  const std::filesystem::file_status before = std::filesystem::symlink_status(place, ignored);
  if (std::filesystem::exists(before) && !std::filesystem::is_directory(before))
    return std::nullopt;
  if (has_alien_files(place)) return std::nullopt;
  const std::filesystem::path aside = place.string() + ".part";
  while (true) {
    if (mkdir(aside.c_str(), 0777) != 0 && errno != EEXIST) {
      if (errno != ENOSPC && errno != EDQUOT) return std::nullopt;
      throw Error("{}: cannot be created: {}; free some space", aside.string(),
                  std::generic_category().message(errno));
    }
    const int lock = ::open(aside.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (lock < 0 && errno == ENOENT) continue;  // another process has just published it
    if (lock < 0) return std::nullopt;
    // Where folders cannot be locked, as on some network drives, processes do not wait for each
    // other.
    while (flock(lock, LOCK_EX) != 0 && errno == EINTR) {
    }
    struct stat named {};
    struct stat locked {};
    const bool is_same = stat(aside.c_str(), &named) == 0 && fstat(lock, &locked) == 0 &&
                         named.st_ino == locked.st_ino && named.st_dev == locked.st_dev;
    if (is_same && access(aside.c_str(), W_OK) == 0 && empty_folder(aside)) {
      return FolderInMaking(place, aside, lock);
    }
    close(lock);
    if (is_same) return std::nullopt;
  }
}

FolderInMaking::FolderInMaking(FolderInMaking&& other) noexcept
    : place_(std::move(other.place_)),
      aside_(std::exchange(other.aside_, {})),
      lock_(std::exchange(other.lock_, -1)) {}

FolderInMaking::~FolderInMaking() {
  try {
    std::error_code ignored;
    if (!aside_.empty() && empty_folder(aside_)) std::filesystem::remove(aside_, ignored);
  } catch (const std::bad_alloc&) {  // the next program that makes this certificate takes it over
  }
  if (lock_ >= 0) close(lock_);
}

void FolderInMaking::publish() {
  std::error_code fault;
  empty_folder(place_);
  std::filesystem::remove(place_, fault);
  std::filesystem::rename(aside_, place_, fault);
  if (fault) {
    throw Error("{}: cannot be replaced: {}; delete it", place_.string(), fault.message());
  }
  aside_.clear();
}

}  // namespace groundray
