#include "apps/view/layers/terrain_follower.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <compare>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/interruption.h"
#include "apps/view/layers/dem_layer.h"
#include "apps/view/layers/ground_colour.h"
#include "core/error.h"
#include "terrain/lod/deviation.h"
#include "terrain/relief/refined_tiles.h"

namespace groundray {

// Samples of a terrain, in memory or in its file.
struct FollowedSource {
  std::shared_ptr<const TileSource> tiles;
  GridFrame frame;
  glm::dvec3 origin_w_m{0};
  std::shared_ptr<const Relief> relief{};
};

namespace {

constexpr std::size_t tile_cache_bytes = std::size_t{64} << 20U;
constexpr double most_whole_samples = 1.2e8;      // limit for a DEM that is kept in memory
constexpr double most_uncertified_samples = 1e9;  // limit for certification while the user waits
constexpr std::size_t coarse_triangles = 25'000;
constexpr double coarse_eye_height_m = 4;
// Initial memory of the windows: it is often sufficient and quickly filled, and the smallest
// windows of any DEM need less.
constexpr std::size_t first_memory_bytes = std::size_t{16} << 20U;
constexpr int most_doublings = 24;

// The terrain of a Simulation supports only its own tolerances, so its DEM is opened again.
FollowedSource open_source(const std::filesystem::path& path, const DemOptions& options,
                           const std::optional<ReliefSpec>& relief, std::size_t memory_bytes,
                           const std::stop_token& stop) {
  DemFile file(path, options);
  const DemHeader header = file.header();
  FollowedSource source{
      .frame = {header.samples, header.origin_m, header.step_m, 1.0 / header.step_m},
      .origin_w_m = header.origin_w_m};
  const double samples = double(header.samples.x) * header.samples.y;
  if (samples <= most_whole_samples) {
    const HeightGrid grid = load_dem(path, options).grid;
    source.tiles = std::make_shared<MemoryTiles>(
        grid, certify(grid, Certificate::block_cells, NodeDetail::Full));
  } else {
    if (samples > most_uncertified_samples && !Certificate::open(file))
      throw Error(
          "{}: {} x {} samples would take minutes to prepare: run `groundray terrain certify` on "
          "it first, or crop it",
          path.string(), header.samples.x, header.samples.y);
    const auto stop_if_asked = [&](double) {
      if (stop.stop_requested()) throw Interrupted{};
    };
    Certificate certificate = Certificate::open_or_make(file, {.progress = stop_if_asked});
    source.tiles =
        std::make_shared<FileTiles>(std::move(file), std::move(certificate), tile_cache_bytes);
  }
  if (relief) {
    const Ground dem(source.tiles, source.frame);
    source.relief = Relief(*relief, source.frame, memory_bytes)
                        .with_trails(
                            relief->trails, [&](glm::dvec2 p) { return dem.height_m_at(p); },
                            glm::dvec2(source.origin_w_m));
    source.tiles = std::make_shared<RefinedTiles>(source.tiles, source.relief);
    source.frame = source.relief->frame();
  }
  return source;
}

std::size_t sample_bytes(std::span<const Level> levels) {
  std::size_t bytes = 0;
  for (const Level& level : levels)
    bytes += level.heights.heights_m().size_bytes() + level.leaves.size() * sizeof(Leaf);
  return bytes;
}

// Returns a lower bound of the distance from an eye to a leaf.
double least_distance_m(const Level& level, const Leaf& leaf, const glm::dvec3& eye_m) {
  const glm::ivec2 first(leaf.column, leaf.row);
  const glm::dvec2 a = level.frame.to_D(first);
  const glm::dvec2 b =
      level.frame.to_D(glm::min(first + level.leaf_cells * leaf.step, level.frame.samples - 1));
  const glm::dvec2 eye(eye_m);
  const glm::dvec2 aside = glm::max(glm::max(glm::min(a, b) - eye, eye - glm::max(a, b)), 0.0);
  return glm::length(glm::dvec3(aside, std::max(0.0, eye_m.z - static_cast<double>(leaf.high_m))));
}

// Returns true if all leaves are as fine as the settings require; otherwise their windows are too
// small.
bool are_fine(std::span<const Level> levels, const ClipmapSettings& settings,
              const glm::dvec3& eye_m) {
  for (const Level& level : levels.subspan(1)) {
    for (const Leaf& leaf : level.leaves) {
      if (leaf.step > level.step || leaf.has_holes) continue;
      const double asked_m =
          std::max(settings.tolerance_m, settings.angle_rad * least_distance_m(level, leaf, eye_m));
      if (static_cast<double>(leaf.deviation_m) > asked_m) return false;
    }
  }
  return true;
}

// Returns the terrain for an eye as it is drawn.
FollowedTerrain followed_terrain(std::span<const Level> levels, std::span<const Level> coarse,
                                 const FollowedSource& source, const Simulation* simulation,
                                 const glm::dvec3& eye_m) {
  FollowedTerrain followed{.layer = terrain_layer(levels, source.origin_w_m, eye_m)};
  Layer coarse_layer = terrain_layer(coarse, source.origin_w_m, eye_m);
  if (simulation != nullptr) {
    add_ground_colour(followed.layer, *simulation);
    add_ground_colour(coarse_layer, *simulation);
  }
  followed.layer.coarse = coarse_layer.data;
  if (simulation != nullptr) drape_ground(followed.layer, *simulation, eye_m);
  followed.triangles = followed.layer.triangles();
  for (const Level& level : levels) followed.leaves += level.leaves.size();
  followed.levels = static_cast<int>(levels.size());
  followed.memory_bytes =
      sample_bytes(levels) + std::size_t{1024} * (followed.layer.data->GetActualMemorySize() +
                                                  followed.layer.coarse->GetActualMemorySize());
  return followed;
}

std::vector<std::string> terrain_facts(const FollowedTerrain& terrain) {
  return {fmt::format("{} triangles of {} leaves in {} levels", terrain.triangles, terrain.leaves,
                      terrain.levels),
          fmt::format("within {:.3g} mrad of distance{}", terrain.angle_rad * 1e3,
                      terrain.is_angle_kept ? "" : ", as far as its windows reach"),
          fmt::format("{:.1f} MB, rebuilt in {:.0f} ms",
                      static_cast<double>(terrain.memory_bytes) / 1e6, terrain.rebuild_s * 1e3)};
}

}  // namespace

struct TerrainFollower::Impl {
  // Settings of a clipmap.
  struct Windows {
    int doublings = 0;        // doublings of TerrainDrawing::angle_rad
    double eye_height_m = 0;  // detail finer than seen from this height is omitted
    std::size_t memory_bytes = 0;
    auto operator<=>(const Windows&) const = default;
  };

  // Selected windows. `is_kept` is false if they are too small for their angle; the leaves then
  // state the remaining deviation.
  struct Chosen {
    Windows windows;
    bool is_kept = true;
  };

  FollowedSource source;
  TerrainDrawing drawing;
  std::shared_ptr<const Simulation> simulation;  // or null
  std::map<Windows, Clipmap> clipmaps;           // the latest clipmap of each
  std::set<Windows> used;                        // settings used for the current viewpoint
  std::optional<FollowedTerrain> shown;          // result of the last call
  glm::dvec3 shown_from_m{0};
  std::mutex mutex;
  int last = 3, last_coarse = 8;  // doublings at the last call

  ClipmapSettings settings(const Windows& windows) const;
  const std::vector<Level>& levels(const Windows& windows, const glm::dvec3& eye_m);
  // Returns the smallest windows, within `windows.memory_bytes`, that satisfy the angle;
  // std::nullopt if they contain more than `triangles`.
  std::optional<Chosen> fit(Windows windows, std::size_t triangles, const glm::dvec3& eye_m);
  // Returns the windows with the fewest doublings of the angle that keep within `triangles`,
  // searched from a guess.
  Chosen choose(Windows guess, std::size_t triangles, const glm::dvec3& eye_m);
};

ClipmapSettings TerrainFollower::Impl::settings(const Windows& windows) const {
  const double angle_rad = std::ldexp(drawing.angle_rad, windows.doublings);
  return {.tolerance_m = angle_rad * windows.eye_height_m,
          .angle_rad = angle_rad,
          .memory_bytes = windows.memory_bytes};
}

const std::vector<Level>& TerrainFollower::Impl::levels(const Windows& windows,
                                                        const glm::dvec3& eye_m) {
  const SensorBox viewer{eye_m, eye_m};
  const bool is_done = !used.insert(windows).second;
  const auto found = clipmaps.find(windows);
  if (found == clipmaps.end()) {
    Clipmap made(source.tiles, source.frame, settings(windows), viewer);
    return clipmaps.emplace(windows, std::move(made)).first->second.levels();
  }
  if (!is_done) found->second = found->second.moved_to(viewer);
  return found->second.levels();
}

auto TerrainFollower::Impl::fit(Windows windows, std::size_t triangles, const glm::dvec3& eye_m)
    -> std::optional<Chosen> {
  const bool is_last = windows.doublings >= most_doublings;
  const std::size_t most_bytes =
      std::exchange(windows.memory_bytes, std::min(first_memory_bytes, windows.memory_bytes));
  while (true) {
    const std::vector<Level>& made = levels(windows, eye_m);
    if (!is_last && count_triangles(made) > triangles) return std::nullopt;
    if (are_fine(made, settings(windows), eye_m)) return Chosen{windows, true};
    if (windows.memory_bytes >= most_bytes) return Chosen{windows, false};
    windows.memory_bytes = std::min(2 * windows.memory_bytes, most_bytes);
  }
}

auto TerrainFollower::Impl::choose(Windows guess, std::size_t triangles, const glm::dvec3& eye_m)
    -> Chosen {
  auto chosen = fit(guess, triangles, eye_m);
  if (!chosen) {
    while (!chosen) {
      ++guess.doublings;
      chosen = fit(guess, triangles, eye_m);
    }
    return *chosen;
  }
  while (guess.doublings > 0) {
    --guess.doublings;
    const auto finer = fit(guess, triangles, eye_m);
    if (!finer) break;
    chosen = finer;
  }
  return *chosen;
}

TerrainFollower::TerrainFollower(std::shared_ptr<const Simulation> simulation,
                                 const TerrainDrawing& drawing, const std::stop_token& stop)
    : impl_(std::make_unique<Impl>()) {
  const TerrainSpec& spec = simulation->spec.terrain;
  impl_->source = open_source(spec.dem, spec.options, spec.relief, drawing.memory_bytes, stop);
  impl_->drawing = drawing;
  impl_->simulation = std::move(simulation);
}

TerrainFollower::TerrainFollower(const std::filesystem::path& dem, const TerrainDrawing& drawing,
                                 const std::stop_token& stop)
    : impl_(std::make_unique<Impl>()) {
  impl_->source = open_source(dem, options_for(dem), std::nullopt, drawing.memory_bytes, stop);
  impl_->drawing = drawing;
}

TerrainFollower::~TerrainFollower() = default;

FollowedTerrain TerrainFollower::follow(const glm::dvec3& viewpoint_w_m) {
  const std::scoped_lock lock(impl_->mutex);
  const auto begin = std::chrono::steady_clock::now();
  Impl& own = *impl_;
  // Rounded to millimetres, so that rounding in the caller's frame does not count as motion.
  const glm::dvec3 eye_m = glm::round((viewpoint_w_m - own.source.origin_w_m) * 1e3) / 1e3;
  if (own.shown && own.shown_from_m == eye_m) return *own.shown;
  own.used.clear();
  const Impl::Chosen full =
      own.choose({.doublings = own.last, .memory_bytes = own.drawing.memory_bytes},
                 own.drawing.triangles, eye_m);
  const Impl::Chosen coarse =
      own.choose({.doublings = own.last_coarse,
                  .eye_height_m = coarse_eye_height_m,
                  .memory_bytes = std::min(first_memory_bytes, own.drawing.memory_bytes)},
                 std::min(coarse_triangles, own.drawing.triangles), eye_m);
  own.last = full.windows.doublings;
  own.last_coarse = coarse.windows.doublings;
  std::erase_if(own.clipmaps, [&](const auto& kept) { return !own.used.contains(kept.first); });
  FollowedTerrain followed =
      followed_terrain(own.levels(full.windows, eye_m), own.levels(coarse.windows, eye_m),
                       own.source, own.simulation.get(), eye_m);
  followed.angle_rad = own.settings(full.windows).angle_rad;
  followed.is_angle_kept = full.is_kept;
  followed.rebuild_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  followed.layer.facts = terrain_facts(followed);
  own.shown = followed;
  own.shown_from_m = eye_m;
  return followed;
}

const glm::dvec3& TerrainFollower::origin_w_m() const { return impl_->source.origin_w_m; }

glm::dvec3 TerrainFollower::overview_w_m() const {
  const GridFrame& frame = impl_->source.frame;
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  const glm::dvec2 centre = (a + b) / 2.0;
  const double size_m = glm::length(a - b);
  return impl_->source.origin_w_m + glm::dvec3(centre.x, centre.y, 0.5 * size_m);
}

}  // namespace groundray
