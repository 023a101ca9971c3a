#include "terrain/lod/certificate.h"

#include <bit>
#include <string>
#include <utility>

#include "core/error.h"
#include "terrain/dem/tiled_tiff.h"
#include "terrain/lod/certificate_files.h"

namespace groundray {

struct Certificate::Files {
  Files(std::filesystem::path where, const DemHeader& dem, CertificateSummary said)
      : folder(std::move(where)),
        lattice{dem.samples, block_cells},
        summary(std::move(said)),
        nodes(folder / nodes_name, nodes_spec(lattice, dem)) {
    for (int level = 1; level <= lattice.top_level(); ++level) {
      heights.push_back(std::make_unique<TiledTiff>(folder / heights_name(level),
                                                    heights_spec(lattice, dem, level)));
    }
  }

  std::filesystem::path folder;
  Lattice lattice;
  CertificateSummary summary;
  TiledTiff nodes;
  std::vector<std::unique_ptr<TiledTiff>> heights;  // of levels 1 and up
};

namespace {

std::string certificate_key(const DemFile& dem) {
  return fmt::format("block_cells {}\n{}", Certificate::block_cells, dem.fingerprint());
}

void check_making(const Certificate::Settings& settings) {
  if (settings.tile_cells < Certificate::block_cells ||
      !std::has_single_bit(static_cast<unsigned>(settings.tile_cells))) {
    throw Error("tile_cells = {} must be a power of two, {} or more", settings.tile_cells,
                Certificate::block_cells);
  }
}

std::string folders_text(const std::vector<std::filesystem::path>& folders) {
  std::string text;
  for (const auto& folder : folders) text += "\n  " + folder.string();
  return text;
}

// Splits the bands of a node raster.
NodeLevel nodes_from_bands(glm::ivec2 size, const std::vector<float>& values) {
  NodeLevel nodes{.size = size};
  auto from = values.begin();
  const std::ptrdiff_t count = std::ssize(values) / 5;
  for (auto* band :
       {&nodes.key_m, &nodes.deviation_m, &nodes.full_m, &nodes.low_m, &nodes.high_m}) {
    band->assign(from, from + count);
    from += count;
  }
  return nodes;
}

}  // namespace

Certificate::Certificate(std::unique_ptr<const Files> files) : files_(std::move(files)) {}
Certificate::~Certificate() = default;
Certificate::Certificate(Certificate&&) noexcept = default;
Certificate& Certificate::operator=(Certificate&&) noexcept = default;

std::optional<Certificate> Certificate::open_in(const std::filesystem::path& folder,
                                                const std::string& key, const DemHeader& dem) {
  auto summary = read_summary(folder, key, {dem.samples, block_cells});
  if (!summary) return std::nullopt;
  try {
    return Certificate(std::make_unique<const Files>(folder, dem, *std::move(summary)));
  } catch (const Error&) {
    return std::nullopt;  // a certificate that cannot be opened is recomputed
  }
}

std::optional<Certificate> Certificate::open(const DemFile& dem) {
  const std::string key = certificate_key(dem);
  for (const auto& folder : certificate_folders(dem)) {
    if (auto found = open_in(folder, key, dem.header())) return found;
  }
  return std::nullopt;
}

Certificate Certificate::open_or_make(const DemFile& dem, const Settings& settings) {
  check_making(settings);
  if (auto found = open(dem)) return *std::move(found);
  const std::string key = certificate_key(dem);
  const Lattice lattice{dem.header().samples, block_cells};
  const auto folders = certificate_folders(dem);
  for (const auto& folder : folders) {
    auto in_making = FolderInMaking::begin(folder);
    if (!in_making) continue;
    // Another process may have completed it in the meantime.
    if (auto found = open_in(folder, key, dem.header())) return *std::move(found);
    const auto summary = certify_file(dem, lattice, in_making->path(), settings);
    write_summary(in_making->path(), key, lattice, summary);
    if (certificate_key(dem) != key) {
      throw Error("{}: it changed while it was certified; certify it again", dem.path().string());
    }
    in_making->publish();
    if (auto made = open_in(folder, key, dem.header())) return *std::move(made);
    throw Error("{}: the certificate just written cannot be read back; is the disk faulty?",
                folder.string());
  }
  throw Error(
      "{}: there is no writable folder for its certificate; set XDG_CACHE_HOME to a writable one. "
      "Tried:{}",
      dem.path().string(), folders_text(folders));
}

const Lattice& Certificate::lattice() const noexcept { return files_->lattice; }
const std::vector<LevelSummary>& Certificate::levels() const noexcept {
  return files_->summary.levels;
}
const std::filesystem::path& Certificate::folder() const noexcept { return files_->folder; }

std::vector<float> Certificate::heights(int level, glm::ivec2 first, glm::ivec2 size) const {
  if (level < 1 || level > lattice().top_level()) {
    throw Error("{}: there are no heights of level {}", folder().string(), level);
  }
  return files_->heights[static_cast<std::size_t>(level) - 1]->read(0, first, size);
}

NodeLevel Certificate::nodes(int level, glm::ivec2 first, glm::ivec2 size) const {
  const int rasters = raster_levels(lattice());
  if (level < rasters) return nodes_from_bands(size, files_->nodes.read(level, first, size));
  if (level > lattice().top_level() || first != glm::ivec2(0) || size != glm::ivec2(1)) {
    throw Error("{}: there are no {} x {} nodes at {}, {} in level {}", folder().string(), size.x,
                size.y, first.x, first.y, level);
  }
  return files_->summary.single_nodes[static_cast<std::size_t>(level - rasters)];
}

}  // namespace groundray
