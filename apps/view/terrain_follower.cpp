#include "apps/view/terrain_follower.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "apps/view/dem_layer.h"
#include "apps/view/ground_colour.h"
#include "apps/view/terrain_surface.h"
#include "core/error.h"
#include "terrain/deviation.h"
#include "terrain/refined_tiles.h"

namespace groundray {
namespace {

constexpr std::size_t tile_cache_bytes = std::size_t{64} << 20U;
constexpr double most_whole_samples = 1.2e8;      // of a DEM that is kept in memory
constexpr double most_uncertified_samples = 1e9;  // that are certified while somebody waits
constexpr std::size_t coarse_triangles = 25'000;
constexpr int most_doublings = 24;

using Tiles = std::shared_ptr<const TileSource>;

struct Source {
  Tiles tiles;
  GridFrame frame;
  glm::dvec3 origin_w_m{0};
  std::shared_ptr<const Relief> relief{};
};

// The terrain of a scene serves the levels of its own tolerances alone, so its DEM is opened anew.
Source open_source(const std::filesystem::path& path, const DemOptions& options,
                   const std::optional<ReliefSpec>& relief, std::size_t memory_bytes) {
  DemFile file(path, options);
  const DemHeader header = file.header();
  Source source{.frame = {header.samples, header.origin_m, header.step_m, 1.0 / header.step_m},
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
          "it "
          "first, or cut out a part",
          path.string(), header.samples.x, header.samples.y);
    Certificate certificate = Certificate::open_or_make(file);
    source.tiles =
        std::make_shared<FileTiles>(std::move(file), std::move(certificate), tile_cache_bytes);
  }
  if (relief) {
    source.relief = std::make_shared<const Relief>(*relief, source.frame, memory_bytes);
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

}  // namespace

struct TerrainFollower::Impl {
  Source source;
  TerrainDrawing drawing;
  std::shared_ptr<const World> world;  // or null
  std::map<int, Clipmap> clipmaps;     // the last one of each angle, by doublings
  std::mutex mutex;

  const Clipmap& clipmap(int doublings, const SensorBox& viewer);
  std::size_t triangles(int doublings, const SensorBox& viewer) {
    return count_triangles(clipmap(doublings, viewer).levels());
  }
  // The fewest doublings of the angle that keep to so many triangles, looked for from a guess.
  int doublings_for(std::size_t triangles, int guess, const SensorBox& viewer);
  int last = 0, last_coarse = 2;
};

const Clipmap& TerrainFollower::Impl::clipmap(int doublings, const SensorBox& viewer) {
  const auto found = clipmaps.find(doublings);
  if (found == clipmaps.end()) {
    const ClipmapSettings settings{.angle_rad = std::ldexp(drawing.angle_rad, doublings),
                                   .memory_bytes = drawing.memory_bytes};
    return clipmaps.emplace(doublings, Clipmap(source.tiles, source.frame, settings, viewer))
        .first->second;
  }
  found->second = found->second.moved_to(viewer);
  return found->second;
}

int TerrainFollower::Impl::doublings_for(std::size_t most, int guess, const SensorBox& viewer) {
  int doublings = guess;
  while (doublings < most_doublings && triangles(doublings, viewer) > most) ++doublings;
  if (doublings > guess) return doublings;
  while (doublings > 0 && triangles(doublings - 1, viewer) <= most) --doublings;
  return doublings;
}

TerrainFollower::TerrainFollower(std::shared_ptr<const World> world, const TerrainDrawing& drawing)
    : impl_(std::make_unique<Impl>()) {
  const TerrainSpec& spec = world->spec.terrain;
  impl_->source = open_source(spec.dem, spec.options, spec.relief, drawing.memory_bytes);
  impl_->drawing = drawing;
  impl_->world = std::move(world);
}

TerrainFollower::TerrainFollower(const std::filesystem::path& dem, const TerrainDrawing& drawing)
    : impl_(std::make_unique<Impl>()) {
  impl_->source = open_source(dem, options_for(dem), std::nullopt, drawing.memory_bytes);
  impl_->drawing = drawing;
}

TerrainFollower::~TerrainFollower() = default;

FollowedTerrain TerrainFollower::follow(const glm::dvec3& viewpoint_w_m) {
  const std::scoped_lock lock(impl_->mutex);
  const auto begin = std::chrono::steady_clock::now();
  Impl& own = *impl_;
  const glm::dvec3 viewpoint_m = viewpoint_w_m - own.source.origin_w_m;
  const SensorBox viewer{viewpoint_m, viewpoint_m};
  own.last = own.doublings_for(own.drawing.triangles, own.last, viewer);
  own.last_coarse =
      own.doublings_for(std::min(coarse_triangles, own.drawing.triangles), own.last_coarse, viewer);
  std::erase_if(own.clipmaps, [&](const auto& kept) {
    return std::abs(kept.first - own.last) > 1 && std::abs(kept.first - own.last_coarse) > 1;
  });
  const std::vector<Level>& levels = own.clipmap(own.last, viewer).levels();
  FollowedTerrain followed{.layer = terrain_layer(levels, own.source.origin_w_m, viewpoint_m)};
  Layer coarse = terrain_layer(own.clipmap(own.last_coarse, viewer).levels(), own.source.origin_w_m,
                               viewpoint_m);
  if (own.world != nullptr) {
    add_ground_colour(followed.layer, *own.world);
    add_ground_colour(coarse, *own.world);
  }
  followed.layer.coarse = coarse.data;
  followed.triangles = followed.layer.triangles();
  for (const Level& level : levels) followed.leaves += level.leaves.size();
  followed.levels = static_cast<int>(levels.size());
  followed.memory_bytes =
      sample_bytes(levels) + std::size_t{1024} * (followed.layer.data->GetActualMemorySize() +
                                                  followed.layer.coarse->GetActualMemorySize());
  followed.angle_rad = std::ldexp(own.drawing.angle_rad, own.last);
  followed.rebuild_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  followed.layer.facts = {
      fmt::format("{} triangles of {} leaves in {} levels", followed.triangles, followed.leaves,
                  followed.levels),
      fmt::format("within {:.3g} mrad of distance", followed.angle_rad * 1e3),
      fmt::format("{:.1f} MB, rebuilt in {:.0f} ms",
                  static_cast<double>(followed.memory_bytes) / 1e6, followed.rebuild_s * 1e3)};
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
