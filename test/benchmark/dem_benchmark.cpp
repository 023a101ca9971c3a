#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "core/tracing/ray_tracer.h"
#include "terrain/dem/dem_io.h"
#include "terrain/terrain_scene.h"
#include "test/benchmark/timing.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::benchmark {
namespace {

// Resident memory of the process, bytes.
double resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) return 1024 * std::stod(line.substr(6));
  }
  return 0;
}

void write_geotiff(const std::string& path, const HeightGrid& grid) {
  GDALAllRegister();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  GDALDataset* file =
      driver->Create(path.c_str(), grid.columns(), grid.rows(), 1, GDT_Float32, nullptr);
  double transform[] = {500000, grid.step_m().x, 0, 4000000, 0, grid.step_m().y};
  file->SetGeoTransform(transform);
  auto* heights_m = const_cast<float*>(grid.heights_m().data());
  if (file->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, grid.columns(), grid.rows(), heights_m,
                                       grid.columns(), grid.rows(), GDT_Float32, 0, 0) != CE_None) {
    throw std::runtime_error("cannot write " + path);
  }
  GDALClose(file);
}

// From a GeoTIFF to a tracer: CPU time of all threads, and memory per cell.
void load_and_build_4097(::benchmark::State& state) {
  const testing::TemporaryFolder folder;
  const std::string path = (folder / "dem.tif").string();
  write_geotiff(path, testing::fractal(4097, 5, 1500, Seed{12345}));
  double bytes = 0;
  for (auto _ : state) {
    const double before_bytes = resident_bytes();
    const double begin_s = processor_s();
    const Dem dem = load_dem(path);
    const RayTracer tracer({full_resolution_level(dem.grid)}, {0, 0, 0}, Tracing::Fast);
    state.SetIterationTime(processor_s() - begin_s);
    bytes = std::max(bytes, resident_bytes() - before_bytes);  // later rounds reuse memory
    Hit hit;
    const Ray down{{0, 0, 1e5}, {0, 0, -1}};
    tracer.trace({&down, 1}, {&hit, 1});
    if (!hit) state.SkipWithError("the ray down misses");
  }
  state.counters["B/cell"] = bytes / (4096. * 4096.);
}
BENCHMARK(load_and_build_4097)->UseManualTime()->Unit(::benchmark::kMillisecond)->Iterations(3);

}  // namespace
}  // namespace groundray::benchmark
