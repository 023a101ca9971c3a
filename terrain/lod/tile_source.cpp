#include "terrain/lod/tile_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <glm/common.hpp>
#include <limits>
#include <list>
#include <map>
#include <mutex>
#include <set>
#include <stop_token>
#include <thread>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "terrain/dem/row_major.h"

namespace groundray {
namespace {

// Rectangle of a level.
struct Window {
  glm::ivec2 first;
  glm::ivec2 size;
};

Window tile_points(const Lattice& lattice, const TileName& name) {
  const glm::ivec2 first = name.which * Tile::cells;
  return {first, glm::min(glm::ivec2(Tile::points), lattice.points(name.level) - first)};
}

Window tile_nodes(const Lattice& lattice, const TileName& name) {
  const glm::ivec2 first = name.which * Tile::nodes;
  return {first, glm::min(glm::ivec2(Tile::nodes), lattice.nodes(name.level) - first)};
}

std::string text_of(const TileName& name) {
  return fmt::format("tile ({}, {}) of level {}", name.which.x, name.which.y, name.level);
}

void check_name(const Lattice& lattice, const TileName& name) {
  const bool has_level = 0 <= name.level && name.level <= lattice.top_level();
  const glm::ivec2 count = has_level ? tile_count(lattice, name.level) : glm::ivec2(0);
  if (0 <= name.which.x && name.which.x < count.x && 0 <= name.which.y && name.which.y < count.y) {
    return;
  }
  throw Error("there is no {}: the last level is {}, and this level has {} x {} tiles",
              text_of(name), lattice.top_level(), count.x, count.y);
}

// Copies rows of `size` values into a square of `side`.
void copy_rows(const float* from, std::ptrdiff_t stride, glm::ivec2 size, float* to, int side) {
  for (int row = 0; row < size.y; ++row) {
    std::copy_n(from + row * stride, size.x, to + static_cast<std::ptrdiff_t>(row) * side);
  }
}

void copy_nodes(const NodeLevel& nodes, glm::ivec2 first, glm::ivec2 size, Tile& tile) {
  const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(first.y) * nodes.size.x + first.x;
  const auto copy = [&](const std::vector<float>& from, Tile::NodeValues& to) {
    copy_rows(from.data() + offset, nodes.size.x, size, to.data(), Tile::nodes);
  };
  copy(nodes.key_m, tile.key_m);
  copy(nodes.deviation_m, tile.deviation_m);
  copy(nodes.full_m, tile.full_m);
  copy(nodes.low_m, tile.low_m);
  copy(nodes.high_m, tile.high_m);
}

float largest_finite(const std::vector<float>& keys_m) {
  float largest = 0;
  for (const float key_m : keys_m) {
    if (key_m < std::numeric_limits<float>::infinity()) largest = std::max(largest, key_m);
  }
  return largest;
}

}  // namespace

std::shared_ptr<Tile> empty_tile(const Lattice& lattice, const TileName& name) {
  check_name(lattice, name);
  auto tile = std::make_shared<Tile>();
  tile->heights_m.fill(std::numeric_limits<float>::quiet_NaN());
  tile->key_m.fill(-1);
  tile->low_m.fill(std::numeric_limits<float>::infinity());
  tile->high_m.fill(-std::numeric_limits<float>::infinity());
  return tile;
}

MemoryTiles::MemoryTiles(HeightGrid grid, std::vector<NodeLevel> levels)
    : grid_(std::move(grid)),
      levels_(std::move(levels)),
      lattice_{{grid_.columns(), grid_.rows()}, Certificate::block_cells} {
  const int top = lattice_.top_level();
  bool is_whole = std::ssize(levels_) == top + 1;
  for (int level = 0; is_whole && level <= top; ++level) {
    const NodeLevel& nodes = levels_[static_cast<std::size_t>(level)];
    is_whole = nodes.size == lattice_.nodes(level) && nodes.low_m.size() == nodes.key_m.size();
    max_key_m_.push_back(largest_finite(nodes.key_m));
  }
  if (!is_whole) {
    throw Error("tiles require all {} levels of the grid, fully certified for blocks of {} cells",
                top + 1, Certificate::block_cells);
  }
}

float MemoryTiles::max_key_m(int level) const {
  return max_key_m_.at(static_cast<std::size_t>(level));
}

std::shared_ptr<const Tile> MemoryTiles::tile(const TileName& name) const {
  auto tile = empty_tile(lattice_, name);
  for_each_point(lattice_, name, [&](std::size_t at, glm::ivec2 sample) {
    tile->heights_m[at] = grid_.height_m(sample.x, sample.y);
  });
  const Window nodes = tile_nodes(lattice_, name);
  copy_nodes(levels_[static_cast<std::size_t>(name.level)], nodes.first, nodes.size, *tile);
  return tile;
}

/// Files, the most recently read tiles, and the thread that prefetches.
class FileTiles::Cache {
 public:
  Cache(DemFile dem, Certificate certificate, std::size_t bytes)
      : dem_(std::move(dem)),
        certificate_(std::move(certificate)),
        capacity_(bytes / sizeof(Tile)),
        worker_([this](const std::stop_token& stop) { read_ahead(stop); }) {}

  const Certificate& certificate() const { return certificate_; }

  std::shared_ptr<const Tile> tile(const TileName& name) {
    check_name(certificate_.lattice(), name);
    std::unique_lock lock(mutex_);
    while (true) {
      if (auto cached = find(name)) return cached;
      if (!is_being_read(name)) return read(name, lock);
      changed_.wait(lock);  // another thread is reading the tile
    }
  }

  void prefetch(std::span<const TileName> names) {
    const std::lock_guard lock(mutex_);
    wanted_.clear();
    for (const TileName& name : names) wanted_.push_back(name);
    changed_.notify_all();
  }

  void wait_for_prefetch() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return wanted_.empty() && !worker_reads_; });
  }

  Statistics statistics() {
    const std::lock_guard lock(mutex_);
    return {reads_, order_.size() * sizeof(Tile)};
  }

 private:
  using Key = std::tuple<int, int, int>;
  struct Entry {
    Key key;
    std::shared_ptr<const Tile> tile;
  };

  static Key key_of(const TileName& name) { return {name.level, name.which.y, name.which.x}; }
  bool is_being_read(const TileName& name) const { return being_read_.contains(key_of(name)); }

  std::shared_ptr<const Tile> find(const TileName& name) {
    const auto found = places_.find(key_of(name));
    if (found == places_.end()) return nullptr;
    order_.splice(order_.begin(), order_, found->second);
    return found->second->tile;
  }

  // Reads a tile, with the lock released meanwhile, and caches it.
  std::shared_ptr<const Tile> read(const TileName& name, std::unique_lock<std::mutex>& lock) {
    const Key key = key_of(name);
    being_read_.insert(key);
    ++reads_;
    lock.unlock();
    std::shared_ptr<const Tile> tile;
    std::exception_ptr fault;
    try {
      tile = read_files(name);
    } catch (...) {
      fault = std::current_exception();
    }
    lock.lock();
    being_read_.erase(key);
    changed_.notify_all();
    if (fault) std::rethrow_exception(fault);
    order_.push_front({key, tile});
    places_[key] = order_.begin();
    for (; order_.size() > capacity_; order_.pop_back()) places_.erase(order_.back().key);
    return tile;
  }

  std::shared_ptr<const Tile> read_files(const TileName& name) const {
    try {
      const Lattice& lattice = certificate_.lattice();
      auto tile = empty_tile(lattice, name);
      const Window points = tile_points(lattice, name);
      const auto heights_m = name.level == 0
                                 ? dem_.read(points.first, points.size)
                                 : certificate_.heights(name.level, points.first, points.size);
      copy_rows(heights_m.data(), points.size.x, points.size, tile->heights_m.data(), Tile::points);
      const Window nodes = tile_nodes(lattice, name);
      copy_nodes(certificate_.nodes(name.level, nodes.first, nodes.size), {0, 0}, nodes.size,
                 *tile);
      return tile;
    } catch (const Error& error) {
      throw Error("{} of {}: {}", text_of(name), dem_.path().string(), error.what());
    }
  }

  void read_ahead(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !wanted_.empty(); })) {
      const TileName name = wanted_.front();
      wanted_.pop_front();
      worker_reads_ = true;
      try {
        check_name(certificate_.lattice(), name);
        if (capacity_ > 0 && !is_being_read(name) && find(name) == nullptr) read(name, lock);
      } catch (const std::exception&) {
        // The error occurs again when the tile is requested.
      }
      worker_reads_ = false;
      changed_.notify_all();
      if (stop.stop_requested()) return;
    }
  }

  DemFile dem_;
  Certificate certificate_;
  std::size_t capacity_;  // tiles

  std::mutex mutex_;  // guards all following members
  std::condition_variable_any changed_;
  std::list<Entry> order_;  // most recently used first
  std::map<Key, std::list<Entry>::iterator> places_;
  std::set<Key> being_read_;
  std::deque<TileName> wanted_;
  bool worker_reads_ = false;
  std::size_t reads_ = 0;

  std::jthread worker_;  // destroyed first
};

FileTiles::FileTiles(DemFile dem, Certificate certificate, std::size_t cache_bytes)
    : cache_(std::make_unique<Cache>(std::move(dem), std::move(certificate), cache_bytes)) {}
FileTiles::~FileTiles() = default;

const Lattice& FileTiles::lattice() const noexcept { return cache_->certificate().lattice(); }
float FileTiles::max_key_m(int level) const {
  return cache_->certificate().levels().at(static_cast<std::size_t>(level)).max_key_m;
}
std::shared_ptr<const Tile> FileTiles::tile(const TileName& name) const {
  return cache_->tile(name);
}
void FileTiles::prefetch(std::span<const TileName> names) const { cache_->prefetch(names); }
void FileTiles::wait_for_prefetch() const { cache_->wait_for_prefetch(); }
FileTiles::Statistics FileTiles::statistics() const { return cache_->statistics(); }

}  // namespace groundray
