// Computation of the rasters of a certificate, in two passes over the DEM.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <future>
#include <glm/common.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "terrain/dem/row_major.h"
#include "terrain/lod/certificate_files.h"
#include "terrain/lod/deviation.h"

namespace groundray {
namespace {

// Fraction of the total time; the rest is spent on deviations.
constexpr double share_of_heights = 0.2;

// Returns the index of a cell in a rectangle of cells stored row by row.
std::ptrdiff_t offset(glm::ivec2 size, glm::ivec2 cell) {
  return static_cast<std::ptrdiff_t>(cell.y) * size.x + cell.x;
}

// Heights of a rectangle of points or samples.
struct Patch {
  glm::ivec2 first{0};
  glm::ivec2 size{0};
  std::vector<float> heights_m;

  HeightWindow window() const { return {first, size, heights_m.data(), size.x}; }
};

// Returns the points of a level that are among the samples of a patch.
Patch level_points(const Lattice& lattice, int level, const Patch& samples) {
  const auto up = [&](glm::ivec2 sample) { return ((sample - 1) >> level) + 1; };
  const glm::ivec2 beyond = samples.first + samples.size;
  const glm::ivec2 all = lattice.points(level);
  // The DEM's last column and row are points of every level.
  const glm::ivec2 end(beyond.x == lattice.samples.x ? all.x : up(beyond).x,
                       beyond.y == lattice.samples.y ? all.y : up(beyond).y);
  Patch points{up(samples.first), {}, {}};
  points.size = end - points.first;
  if (points.size.x <= 0 || points.size.y <= 0) return {};
  points.heights_m.reserve(value_count(points.size));
  for (int row = points.first.y; row < end.y; ++row) {
    for (int column = points.first.x; column < end.x; ++column) {
      const glm::ivec2 at = lattice.sample(level, {column, row}) - samples.first;
      points.heights_m.push_back(samples.heights_m[value_index(at, samples.size.x)]);
    }
  }
  return points;
}

// Appends those tiles of the square of `side` tiles from `first` on that lie below `count`, in Z
// order: each larger tile of four is completed before the next one begins.
void add_in_z_order(glm::ivec2 first, int side, glm::ivec2 count, std::vector<glm::ivec2>& tiles) {
  if (first.x >= count.x || first.y >= count.y) return;
  if (side == 1) return tiles.push_back(first);
  const int half = side / 2;
  for (const glm::ivec2 quarter : {glm::ivec2{0, 0}, {half, 0}, {0, half}, {half, half}}) {
    add_in_z_order(first + quarter, half, count, tiles);
  }
}

// Extent of a tile: its own samples only, or also the first column and row of its neighbours
// (Common), which complete its last cells.
enum class Sides { Own, Common };

// Reads the DEM tile by tile; each tile is read while the previous one is processed.
class TileReader {
 public:
  TileReader(const DemFile& dem, int tile_cells, Sides sides)
      : dem_(dem), tile_cells_(tile_cells), sides_(sides) {
    const glm::ivec2 count = (dem.header().samples - 2) / tile_cells + 1;
    const int side = std::max(count.x, count.y);
    add_in_z_order({0, 0}, static_cast<int>(std::bit_ceil(static_cast<unsigned>(side))), count,
                   tiles_);
    read_ahead();
  }

  std::size_t count() const { return tiles_.size(); }
  Patch next() {
    Patch patch = ahead_.get();
    read_ahead();
    return patch;
  }

 private:
  void read_ahead() {
    if (next_ == tiles_.size()) return;
    ahead_ = std::async(std::launch::async, [this, tile = tiles_[next_]] { return read(tile); });
    ++next_;
  }
  Patch read(glm::ivec2 tile) const {
    const glm::ivec2 first = tile * tile_cells_;
    const glm::ivec2 rest = dem_.header().samples - first;
    const auto length = [&](int left) {
      const int whole = sides_ == Sides::Common ? tile_cells_ + 1 : tile_cells_;
      return left <= tile_cells_ + 1 ? left : whole;
    };
    const glm::ivec2 size(length(rest.x), length(rest.y));
    return {first, size, dem_.read(first, size)};
  }

  const DemFile& dem_;
  int tile_cells_;
  Sides sides_;
  std::vector<glm::ivec2> tiles_;
  std::size_t next_ = 0;
  std::future<Patch> ahead_;  // its destructor waits
};

void write_heights(const DemFile& dem, const Lattice& lattice, const std::filesystem::path& folder,
                   const Certificate::Settings& settings) {
  std::vector<std::unique_ptr<TiledTiffWriter>> files;
  for (int level = 1; level <= lattice.top_level(); ++level) {
    files.push_back(std::make_unique<TiledTiffWriter>(folder / heights_name(level),
                                                      heights_spec(lattice, dem.header(), level)));
  }
  TileReader tiles(dem, settings.tile_cells, Sides::Own);
  for (std::size_t done = 0; done < tiles.count(); ++done) {
    const Patch samples = tiles.next();
    for (int level = 1; level <= lattice.top_level(); ++level) {
      const Patch points = level_points(lattice, level, samples);
      if (points.heights_m.empty()) continue;
      const std::array bands{points.heights_m.data()};
      files[static_cast<std::size_t>(level) - 1]->write(0, points.first, points.size, bands);
    }
    if (settings.progress) {
      settings.progress(share_of_heights * static_cast<double>(done + 1) /
                        static_cast<double>(tiles.count()));
    }
  }
  for (const auto& file : files) file->close();
}

// Second pass: deviations of the nodes.
class NodePass {
 public:
  NodePass(const DemFile& dem, const Lattice& lattice, const std::filesystem::path& folder,
           int tile_cells)
      : lattice_(lattice),
        folder_(folder),
        finest_coarse_(std::countr_zero(static_cast<unsigned>(tile_cells / lattice.block_cells)) +
                       1),
        file_(folder / nodes_name, nodes_spec(lattice, dem.header())) {
    const int top = lattice.top_level();
    summary_.levels.resize(static_cast<std::size_t>(top) + 1);
    for (int level = finest_coarse_; level <= top; ++level) {
      coarse_.push_back(unknown_nodes(lattice.nodes(level), NodeDetail::Full));
      heights_.push_back(std::make_unique<TiledTiff>(folder / heights_name(level),
                                                     heights_spec(lattice, dem.header(), level)));
    }
    if (!coarse_.empty()) {
      below_coarse_ = unknown_nodes(lattice.nodes(finest_coarse_ - 1), NodeDetail::Full);
    }
  }

  // Completes the nodes in a tile on levels whose nodes are no larger than a tile, and accumulates
  // into those of the coarser levels.
  void add(const Patch& samples) {
    const int top = lattice_.top_level();
    NodeLevel below;
    glm::ivec2 first_below{0};
    for (int level = 0; level < std::min(finest_coarse_, top + 1); ++level) {
      const glm::ivec2 first = node_of(level, samples.first);
      const glm::ivec2 size = node_of(level, samples.first + samples.size - 2) - first + 1;
      NodeLevel nodes = unknown_nodes(size, NodeDetail::Full);
      const Patch points = level == 0 ? Patch{} : level_points(lattice_, level, samples);
      accumulate_deviations(lattice_, level, samples.window(),
                            level == 0 ? samples.window() : points.window(), first, nodes);
      if (level > 0) saturate_keys(nodes, first, below, first_below);
      keep(level, first, nodes);
      below = std::move(nodes);
      first_below = first;
    }
    if (!coarse_.empty()) keep_below(below, first_below);
    for (int level = finest_coarse_; level <= top; ++level) add_to_coarse(level, samples);
  }

  CertificateSummary finish() {
    const NodeLevel* below = &below_coarse_;
    for (int level = finest_coarse_; level <= lattice_.top_level(); ++level) {
      NodeLevel& nodes = coarse(level);
      saturate_keys(nodes, {0, 0}, *below, {0, 0});
      keep(level, {0, 0}, nodes);
      below = &nodes;
    }
    for (LevelSummary& level : summary_.levels) {
      if (level.nodes > level.empty) {
        level.mean_deviation_m /= static_cast<double>(level.nodes - level.empty);
      }
    }
    file_.close();
    return std::move(summary_);
  }

 private:
  NodeLevel& coarse(int level) { return coarse_[static_cast<std::size_t>(level - finest_coarse_)]; }

  // Returns the node that contains the cell to the south-east of a sample.
  glm::ivec2 node_of(int level, glm::ivec2 sample) const {
    return (sample >> level) / lattice_.block_cells;
  }

  void add_to_coarse(int level, const Patch& samples) {
    const glm::ivec2 first_node = node_of(level, samples.first);
    const glm::ivec2 end_node = node_of(level, samples.first + samples.size - 2) + 1;
    const glm::ivec2 first = first_node * lattice_.block_cells;
    const glm::ivec2 size =
        glm::min(end_node * lattice_.block_cells + 1, lattice_.points(level)) - first;
    const Patch points{
        first, size,
        heights_[static_cast<std::size_t>(level - finest_coarse_)]->read(0, first, size)};
    accumulate_deviations(lattice_, level, samples.window(), points.window(), {0, 0},
                          coarse(level));
  }

  // Copies nodes of the level below the coarse ones into `below_coarse_`.
  void keep_below(const NodeLevel& nodes, glm::ivec2 first) {
    for (const auto band : {&NodeLevel::key_m, &NodeLevel::deviation_m, &NodeLevel::full_m,
                            &NodeLevel::low_m, &NodeLevel::high_m}) {
      for (int row = 0; row < nodes.size.y; ++row) {
        const auto from = (nodes.*band).begin() + offset(nodes.size, {0, row});
        const auto to =
            (below_coarse_.*band).begin() + offset(below_coarse_.size, {first.x, first.y + row});
        std::copy_n(from, nodes.size.x, to);
      }
    }
  }

  // Writes and counts nodes that are final.
  void keep(int level, glm::ivec2 first, const NodeLevel& nodes) {
    LevelSummary& summary = summary_.levels[static_cast<std::size_t>(level)];
    summary.nodes += nodes.key_m.size();
    for (std::size_t i = 0; i < nodes.key_m.size(); ++i) {
      const float key_m = nodes.key_m[i];
      if (key_m < 0) {
        ++summary.empty;
        continue;
      }
      if (std::isinf(key_m)) {
        ++summary.mixed;
      } else {
        summary.max_key_m = std::max(summary.max_key_m, key_m);
      }
      summary.max_deviation_m = std::max(summary.max_deviation_m, nodes.deviation_m[i]);
      summary.mean_deviation_m += nodes.deviation_m[i];  // a sum until finish()
    }
    if (level >= raster_levels(lattice_)) {
      summary_.single_nodes.push_back(nodes);
      return;
    }
    const std::array bands{nodes.key_m.data(), nodes.deviation_m.data(), nodes.full_m.data(),
                           nodes.low_m.data(), nodes.high_m.data()};
    file_.write(level, first, nodes.size, bands);
  }

  const Lattice& lattice_;
  std::filesystem::path folder_;
  int finest_coarse_;  // first level whose nodes are larger than a tile
  TiledTiffWriter file_;
  CertificateSummary summary_;
  std::vector<NodeLevel> coarse_;  // complete levels, from finest_coarse_ on
  std::vector<std::unique_ptr<TiledTiff>> heights_;
  NodeLevel below_coarse_;  // level finest_coarse_ - 1, complete
};

}  // namespace

CertificateSummary certify_file(const DemFile& dem, const Lattice& lattice,
                                const std::filesystem::path& folder,
                                const Certificate::Settings& settings) {
  write_heights(dem, lattice, folder, settings);
  NodePass pass(dem, lattice, folder, settings.tile_cells);
  TileReader tiles(dem, settings.tile_cells, Sides::Common);
  for (std::size_t done = 0; done < tiles.count(); ++done) {
    pass.add(tiles.next());
    if (settings.progress) {
      settings.progress(share_of_heights + (1 - share_of_heights) * static_cast<double>(done + 1) /
                                               static_cast<double>(tiles.count()));
    }
  }
  CertificateSummary summary = pass.finish();
  const LevelSummary& top = summary.levels.back();
  if (top.empty == top.nodes) {
    throw Error(
        "{}: none of its {} x {} samples has a height, all are nodata; is that value correct?",
        dem.path().string(), lattice.samples.x, lattice.samples.y);
  }
  return summary;
}

}  // namespace groundray
