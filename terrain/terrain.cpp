#include "terrain/terrain.h"

#include <fmt/format.h>

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "terrain/dem/byte_hash.h"
#include "terrain/lod/deviation.h"
#include "terrain/relief/refined_tiles.h"
#include "terrain/terrain_scene.h"

namespace groundray {
namespace {

constexpr std::size_t tile_cache_bytes = std::size_t{64} << 20;

std::size_t memory_bytes(const TerrainDetail& detail) {
  return std::size_t{detail.memory_mib} << 20;
}

template <typename T>
std::string_view bytes_of(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

GridFrame frame_of(const DemHeader& header) {
  return {header.samples, header.origin_m, header.step_m, 1.0 / header.step_m};
}

}  // namespace

namespace {

constexpr double whole_sample_bytes = 36;  // with grids, measured

double count(glm::ivec2 samples) { return static_cast<double>(samples.x) * samples.y; }

bool fits(glm::ivec2 samples, const TerrainDetail& detail) {
  return whole_sample_bytes * count(samples) <= static_cast<double>(memory_bytes(detail));
}

// Returns hashes of heights and grid, which identify the DEM.
std::string fingerprint_of(const HeightGrid& grid) {
  const double place[] = {grid.origin_m().x, grid.origin_m().y, grid.step_m().x, grid.step_m().y};
  return fmt::format("{:016x}{:016x}", byte_hash(bytes_of(grid.heights_m())),
                     byte_hash(bytes_of(std::span<const double>(place))));
}

}  // namespace

// Loads a DEM without its relief, as a whole or by tiles, depending on the size of the surface with
// `relief`, which may be null.
Terrain::Loaded Terrain::load_dem_alone(DemFile file, const TerrainDetail& detail,
                                        const Progress& progress, const Relief* relief,
                                        const std::optional<ErosionSpec>& erosion) {
  const DemHeader header = file.header();
  if (!fits(header.samples, detail)) {
    if (erosion) {
      throw Error(
          "erosion needs all of the DEM in memory, but its {} x {} samples exceed memory_mib = {}: "
          "cut the DEM, or raise memory_mib",
          header.samples.x, header.samples.y, detail.memory_mib);
    }
    const std::string text = file.fingerprint();
    Certificate certificate = Certificate::open_or_make(file, {.progress = progress});
    const Tiles tiles =
        std::make_shared<FileTiles>(std::move(file), std::move(certificate), tile_cache_bytes);
    return {header,
            tiles,
            Ground(tiles, frame_of(header)),
            fmt::format("{:016x}", byte_hash(text)),
            {}};
  }
  HeightGrid grid = file.load().grid;
  if (erosion) grid = eroded(grid, *erosion, memory_bytes(detail));
  const bool is_whole = relief == nullptr || fits(relief->frame().samples, detail);
  if (is_whole && detail.tolerance_m == 0 && detail.tolerance_rad == 0)
    return {header, grid, Ground(grid), fingerprint_of(grid), {}};
  std::vector<NodeLevel> levels = certify(grid, Certificate::block_cells, NodeDetail::Full);
  return {header,
          std::make_shared<MemoryTiles>(grid, std::move(levels)),
          Ground(grid),
          fingerprint_of(grid),
          {}};
}

Terrain::Loaded Terrain::load(DemFile file, const TerrainDetail& detail, const Progress& progress,
                              const std::optional<ReliefSpec>& spec,
                              const std::optional<ErosionSpec>& erosion) {
  if (!spec) return load_dem_alone(std::move(file), detail, progress, nullptr, erosion);
  const Relief without_trails(*spec, frame_of(file.header()), memory_bytes(detail));
  Loaded loaded = load_dem_alone(std::move(file), detail, progress, &without_trails, erosion);
  const auto relief = without_trails.with_trails(
      spec->trails, [&](glm::dvec2 p) { return loaded.ground.height_m_at(p); },
      loaded.header.origin_w_m);
  if (const auto* grid = std::get_if<HeightGrid>(&loaded.content)) {
    loaded.content = relief->refined(*grid);
    loaded.ground = std::get<HeightGrid>(loaded.content);
  } else {
    loaded.content = std::make_shared<RefinedTiles>(std::get<Tiles>(loaded.content), relief);
    loaded.ground = Ground(loaded.ground, relief);
  }
  loaded.fingerprint += fmt::format("{:016x}", relief->fingerprint());
  loaded.relief = relief;
  return loaded;
}

Terrain::Terrain(const std::filesystem::path& dem, const DemOptions& options,
                 const TerrainDetail& detail, const Progress& progress,
                 const std::optional<ReliefSpec>& relief, const std::optional<ErosionSpec>& erosion)
    : detail_(detail), loaded_(load(DemFile(dem, options), detail, progress, relief, erosion)) {}

Level Terrain::whole_level() const {
  return full_resolution_level(*whole(), static_cast<double>(memory_bytes(detail_)));
}

double Terrain::whole_bytes(glm::ivec2 samples) noexcept {
  const double with_quads = quad_cell_bytes * count(samples - 1);
  return with_quads <= most_quad_bytes ? with_quads : whole_sample_bytes * count(samples);
}

Clipmap Terrain::clipmap(const SensorBox& sensors, double reach_m) const {
  return {std::get<Tiles>(loaded_.content),
          frame(),
          {.tolerance_m = detail_.tolerance_m,
           .angle_rad = detail_.tolerance_rad,
           .memory_bytes = memory_bytes(detail_),
           .reach_m = reach_m},
          sensors};
}

}  // namespace groundray
