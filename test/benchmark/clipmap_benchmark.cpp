// Cost of following a moving sensor over a large DEM, and of tracing through the levels.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <vector>

#include "terrain/dem/dem_io.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/tile_source.h"
#include "terrain/terrain_scene.h"
#include "test/benchmark/timing.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::benchmark {
namespace {

namespace fs = std::filesystem;

// The DEM of the Moon in metres, warped once and kept beside the build; empty without the shared
// data.
fs::path moon() {
  const fs::path source =
      testing::shared_data_folder() / "dem/moon_gld100_8193/moon_gld100_8193.tif";
  const fs::path warped = "build/bench/moon_metric.tif";
  if (fs::exists(warped) || !fs::exists(source)) return fs::exists(warped) ? warped : fs::path();
  fs::create_directories(warped.parent_path());
  const std::string command = fmt::format(
      "gdalwarp -q -t_srs '+proj=tmerc +lat_0=30 +lon_0=16 +R=1737400 +units=m +no_defs' -te "
      "-400000 -400000 400000 400000 -ts 8192 8192 -r bilinear -ot Int16 -co TILED=YES -co "
      "COMPRESS=DEFLATE -co PREDICTOR=2 {} {}.part.tif && mv {}.part.tif {}",
      source.string(), warped.string(), warped.string(), warped.string());
  return std::system(command.c_str()) == 0 ? warped : fs::path();
}

std::shared_ptr<const FileTiles> open_tiles(const fs::path& path, GridFrame& frame) {
  DemFile file(path);
  const DemHeader header = file.header();
  frame = {header.samples, header.origin_m, header.step_m, 1.0 / header.step_m};
  Certificate certificate = Certificate::open_or_make(file);
  return std::make_shared<const FileTiles>(std::move(file), std::move(certificate),
                                           std::size_t{64} << 20);
}

// Windows of 512 x 512 cells of each level, for all levels of the DEM.
ClipmapSettings windows_of_512(const Lattice& lattice) {
  std::size_t levels = 1;
  for (int level = 0; std::max(lattice.cells(level).x, lattice.cells(level).y) > 512; ++level)
    ++levels;
  return {.memory_bytes = 40 * std::size_t{512} * (512 + 32) * levels};
}

// A path that moves by one snap of level 0 per step: diagonally, straight, and round corners.
std::vector<glm::dvec3> snaps(const GridFrame& frame, int steps) {
  const glm::dvec2 unit_m = 16.0 * glm::abs(frame.step_m);
  const double room_m = 0.3 * std::min(std::abs(frame.step_m.x) * frame.samples.x,
                                       std::abs(frame.step_m.y) * frame.samples.y);
  glm::dvec2 way(1, 1);
  glm::dvec3 p(frame.to_D(frame.samples / 2), 0);
  const glm::dvec2 middle(p);
  std::vector<glm::dvec3> places;
  for (int i = 0; i < steps; ++i) {
    places.push_back(p);
    if (i % 37 == 36) way = glm::dvec2(-way.y, way.x);
    if (i % 53 == 52) way.x = way.x == 0 ? 1 : 0;
    if (way == glm::dvec2(0)) way.y = 1;
    if (glm::length(glm::dvec2(p) + way * unit_m - middle) > room_m) way = -way;
    p += glm::dvec3(way * unit_m, 0);
  }
  return places;
}

double megabytes(const RayTracer& tracer) {
  double bytes = static_cast<double>(tracer.device().memory_bytes());
  for (const LevelScene& scene : tracer.levels())
    bytes += static_cast<double>(scene.level().heights.heights_m().size_bytes());
  return 1e-6 * bytes;
}

void step_over(::benchmark::State& state, const GridFrame& frame,
               const std::shared_ptr<const TileSource>& tiles) {
  const auto settings = windows_of_512(tiles->lattice());
  std::vector<double> steps_s;
  for (auto _ : state) {
    steps_s.clear();
    const auto places = snaps(frame, 400);
    Clipmap clipmap(tiles, frame, settings, {places[0], places[0]});
    RayTracer tracer = build_tracer(clipmap, {places[0].x, places[0].y, 0}, Tracing::Fast);
    const glm::dvec3 p_DL(places[0].x, places[0].y, 0);
    for (std::size_t i = 1; i < places.size(); ++i) {
      const auto begin = Clock::now();
      clipmap = clipmap.moved_to({places[i], places[i]});
      tracer = build_tracer(clipmap, p_DL, Tracing::Fast, &tracer);
      steps_s.push_back(seconds_since(begin));
    }
    const Clipmap scratch(tiles, frame, settings, {places.back(), places.back()});
    for (std::size_t i = 0; i < scratch.levels().size(); ++i) {
      if (scratch.levels()[i].leaves != clipmap.levels()[i].leaves)
        state.SkipWithError("the steps do not lead to the state from scratch");
    }
    state.counters["levels"] = static_cast<double>(clipmap.levels().size());
    state.counters["MB"] = megabytes(tracer);
  }
  std::ranges::sort(steps_s);
  state.counters["median_ms"] = 1e3 * steps_s[steps_s.size() / 2];
  state.counters["p99_ms"] = 1e3 * steps_s[steps_s.size() * 99 / 100];
}

void terrain_step_moon(::benchmark::State& state) {
  const fs::path path = moon();
  if (path.empty()) return state.SkipWithError("skipped: the shared data has no Moon DEM");
  GridFrame frame;
  const auto tiles = open_tiles(path, frame);
  step_over(state, frame, tiles);
}
BENCHMARK(terrain_step_moon)->Unit(::benchmark::kMillisecond)->Iterations(1);

// The VRT of 65,536 x 65,536 samples; GROUNDRAY_BENCH_VRT names it (see make_big_vrt.py).
void terrain_step_65536(::benchmark::State& state) {
  const char* path = std::getenv("GROUNDRAY_BENCH_VRT");
  if (path == nullptr) return state.SkipWithError("skipped: GROUNDRAY_BENCH_VRT is not set");
  GridFrame frame;
  const auto tiles = open_tiles(path, frame);
  step_over(state, frame, tiles);
}
BENCHMARK(terrain_step_65536)->Unit(::benchmark::kMillisecond)->Iterations(1);

// The same number of cells in the finest windows, from a DEM with 1/64 of the width.
void terrain_step_1025(::benchmark::State& state) {
  const HeightGrid grid = testing::fractal(1025, 100, 3000, Seed{1});
  const auto tiles = std::make_shared<const MemoryTiles>(
      grid, certify(grid, Certificate::block_cells, NodeDetail::Full));
  step_over(state, grid.frame(), tiles);
}
BENCHMARK(terrain_step_1025)->Unit(::benchmark::kMillisecond)->Iterations(1);

// Beams of a spinning head 2.5 m above ground, fan by fan.
std::vector<Ray> lidar_rays(const HeightGrid& grid) {
  const glm::dvec2 place(310, -170);
  const glm::dvec3 origin(place, *grid.height_m_at(place) + 2.5);
  std::vector<Ray> rays;
  for (int azimuth = 0; azimuth < 1800; azimuth += 8) {
    for (int beam = 0; beam < 128; ++beam) {
      const double elevation = -0.43 + 0.0054 * beam;
      for (int k = 0; k < 8; ++k) {
        const double turn = 6.2831853 * (azimuth + k) / 1800;
        rays.push_back({origin,
                        {std::cos(turn) * std::cos(elevation), std::sin(turn) * std::cos(elevation),
                         std::sin(elevation)}});
      }
    }
  }
  return rays;
}

// The grid as one level, built of single triangles.
Level level_of_triangles(const HeightGrid& grid) {
  Level level = full_resolution_level(grid);
  for (Leaf& leaf : level.leaves)
    leaf.has_holes = true;  // leaves with holes are built triangle by triangle
  return level;
}

void terrain_rays(::benchmark::State& state) {
  const HeightGrid grid = testing::fractal(2049, 5, 1000, Seed{12345});
  const auto rays = lidar_rays(grid);
  const glm::dvec3 p_DL = float_frame_origin(rays[0].origin);
  const auto tiles = std::make_shared<const MemoryTiles>(
      grid, certify(grid, Certificate::block_cells, NodeDetail::Full));
  const Clipmap clipmap(tiles, grid.frame(), windows_of_512(tiles->lattice()),
                        {rays[0].origin, rays[0].origin});
  const std::array<RayTracer, 3> tracers = {
      build_tracer(clipmap, p_DL, Tracing::Fast),
      RayTracer({full_resolution_level(grid)}, p_DL, Tracing::Fast),
      RayTracer({level_of_triangles(grid)}, p_DL, Tracing::Fast)};
  std::vector<Hit> hits(rays.size()), truth(rays.size());
  tracers[2].trace(rays, truth);
  tracers[1].trace(rays, hits);
  std::size_t different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    different += hits[i].range_m != truth[i].range_m ? 1 : 0;
  }
  if (different > 2) state.SkipWithError("grids and triangles disagree");
  std::array<double, 3> total_s{};
  for (auto _ : state) {
    for (std::size_t k = 0; k < tracers.size(); ++k) {
      const auto begin = Clock::now();
      tracers[k].trace(rays, hits);
      total_s[k] += seconds_since(begin);
    }
  }
  state.counters["Mrays/s"] = 1e-6 * static_cast<double>(rays.size()) *
                              static_cast<double>(state.iterations()) / total_s[0];
  state.counters["of_grid"] = total_s[1] / total_s[0];
  state.counters["of_triangles"] = total_s[2] / total_s[0];
  state.counters["MB"] = megabytes(tracers[0]);
  state.counters["grid_MB"] = megabytes(tracers[1]);
  state.counters["triangles_MB"] = megabytes(tracers[2]);
}
BENCHMARK(terrain_rays)->Unit(::benchmark::kMillisecond)->MinTime(4);

}  // namespace
}  // namespace groundray::benchmark
