// From heights to a mesh: CPU time of all threads, memory, and the cost of a textbook quadtree.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "terrain/judge/mesh_deviation.h"
#include "terrain/judge/mesh_topology.h"
#include "terrain/lod/deviation.h"
#include "terrain/terrain_mesh.h"
#include "test/benchmark/landscape.h"
#include "test/benchmark/pointer_quadtree.h"
#include "test/benchmark/timing.h"

namespace groundray::benchmark {
namespace {

constexpr int block_cells = 2;

// Peak memory of the process since `forget_peak`, bytes.
void forget_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}
double peak_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return 1024 * std::stod(line.substr(6));
  }
  return 0;
}

// Writes the samples so that other programs can mesh the same heights; see terrain_peers.py.
void export_heights(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "size.txt") << mountains().columns() << ' ' << mountains().rows() << '\n';
  const auto heights_m = mountains().heights_m();
  std::ofstream(folder / "heights.f32", std::ios::binary)
      .write(reinterpret_cast<const char*>(heights_m.data()),
             static_cast<std::streamsize>(heights_m.size_bytes()));
}

// The whole pipeline: certify every node, select, balance, emit.
void terrain_mesh(::benchmark::State& state) {
  if (const char* folder = std::getenv("GROUNDRAY_BENCH_EXPORT")) export_heights(folder);
  const MeshBound bound{.tolerance_m = static_cast<double>(state.range(0))};
  {
    const TerrainMesh mesh = build_terrain_mesh(mountains(), bound, block_cells);
    const auto found = judge::largest_deviation(mountains(), mesh.vertices, mesh.triangles);
    if (found.largest_m > bound.tolerance_m * (1 + 1e-15))
      return state.SkipWithError("the mesh is too far off");
    if (!judge::topology_faults(mountains(), mesh.vertices, mesh.triangles).empty()) {
      return state.SkipWithError("the mesh does not conform");
    }
    state.counters["largest_m"] = found.largest_m;
    state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
  }
  double bytes = 0;
  for (auto _ : state) {
    forget_peak();
    const double begin_s = processor_s();
    ::benchmark::DoNotOptimize(build_terrain_mesh(mountains(), bound, block_cells));
    state.SetIterationTime(processor_s() - begin_s);
    bytes = std::max(bytes, peak_bytes());
  }
  state.counters["peak_MB"] = 1e-6 * bytes;  // includes the 67 MB of heights and the program itself
}
BENCHMARK(terrain_mesh)
    ->ArgName("tolerance_m")
    ->Arg(5)
    ->Arg(1)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->Iterations(5);

// Each triangle as the samples at its corners, the least first; the list is sorted.
std::vector<std::array<std::int64_t, 3>> sorted_triangles(const TerrainMesh& mesh) {
  std::vector<std::array<std::int64_t, 3>> triangles;
  for (const glm::uvec3& t : mesh.triangles) {
    std::array<std::int64_t, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::ivec2 p = mesh.vertices[t[static_cast<int>(i)]];
      corners[i] = (std::int64_t{p.y} << 32) + p.x;
    }
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    triangles.push_back(corners);
  }
  std::ranges::sort(triangles);
  return triangles;
}

// Counts the passes that are run, and notes the start of the first one after `skipped`.
struct PassClock {
  std::size_t skipped = 0;
  std::size_t passes = 0;
  double begin_s = 0;

  PassRunner runner() {
    return [this](std::size_t count, const PassRunner::Work& work) {
      if (passes++ == skipped) begin_s = processor_s();
      run_in_parallel(count, work);
    };
  }
};

// Selection, balancing and emission alone, both from the same keys: for groundray, the passes after
// those of `certify`. Both run alternately in every iteration, so that their ratio is measured
// under the same load.
void terrain_against_pointer_quadtree(::benchmark::State& state) {
  const auto tolerance_m = static_cast<double>(state.range(0));
  PassClock certifying;
  const auto levels = certify(mountains(), block_cells, NodeDetail::KeysOnly, certifying.runner());
  const MeshBound bound{.tolerance_m = tolerance_m};
  const auto ours = sorted_triangles(build_terrain_mesh(mountains(), bound, block_cells));
  if (ours != sorted_triangles(mesh_by_pointers(mountains(), levels, block_cells, tolerance_m))) {
    return state.SkipWithError("the meshes differ");
  }
  double ours_s = 0, pointers_s = 0;
  for (auto _ : state) {
    PassClock clock{.skipped = certifying.passes};
    ::benchmark::DoNotOptimize(build_terrain_mesh(mountains(), bound, block_cells, clock.runner()));
    const double this_s = processor_s() - clock.begin_s;
    ours_s += this_s;
    const double begin_s = processor_s();
    ::benchmark::DoNotOptimize(mesh_by_pointers(mountains(), levels, block_cells, tolerance_m));
    pointers_s += processor_s() - begin_s;
    state.SetIterationTime(this_s);
  }
  state.counters["triangles"] = static_cast<double>(ours.size());
  state.counters["pointers_ms"] = 1e3 * pointers_s / static_cast<double>(state.iterations());
  state.counters["times_faster"] = pointers_s / ours_s;
}
BENCHMARK(terrain_against_pointer_quadtree)
    ->ArgName("tolerance_m")
    ->Arg(5)
    ->Arg(1)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);

}  // namespace
}  // namespace groundray::benchmark
