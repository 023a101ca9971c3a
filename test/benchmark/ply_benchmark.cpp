#include <benchmark/benchmark.h>

#include <algorithm>
#include <filesystem>

#include "apps/scene/readers/scene_reader.h"
#include "core/io/ply_io.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/support/temporary_folder.h"

namespace groundray::benchmark {
namespace {

using namespace std::chrono_literals;

// The columns of a real scan: flat ground seen by 128 beams.
void write_scan(::benchmark::State& state) {
  const HeightGrid flat({2, 2}, {-2000, -2000}, {4000, 4000}, {0, 0, 0, 0});
  const Scene scene{RayTracer({full_resolution_level(flat)}, {0, 0, 0}, Tracing::Fast), {}};
  const Trajectory X_DS({{0s, {{1, 0, 0, 0}, {0, 0, 2}}}, {1s, {{1, 0, 0, 0}, {0, 0, 2}}}});
  const Lidar lidar(load_lidar(testing::data_folder() / "sensors/velodyne_vls128.yaml"));
  const PointCloud scan = lidar.scan(scene, X_DS, 0, Seed{7}, 0).echoes;
  const testing::TemporaryFolder folder;
  const auto path = folder / "scan.ply";
  write_ply(path, scan, {});
  const PointCloud read = read_ply(path).cloud;
  if (!std::ranges::equal(read.column<double>("range_true"), scan.column<double>("range_true")))
    return state.SkipWithError("the file differs");
  for (auto _ : state) write_ply(path, scan, {});
  state.SetBytesProcessed(static_cast<std::int64_t>(std::filesystem::file_size(path)) *
                          state.iterations());
}
BENCHMARK(write_scan)->UseRealTime()->Unit(::benchmark::kMillisecond);

}  // namespace
}  // namespace groundray::benchmark
