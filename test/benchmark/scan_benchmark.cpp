// Cost of a whole scan compared with the rays alone. Both run alternately in every iteration, so
// that their ratio is measured under the same load.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "apps/scene/readers/scene_reader.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/benchmark/landscape.h"
#include "test/benchmark/raw_embree.h"
#include "test/benchmark/timing.h"
#include "test/support/temporary_folder.h"

namespace groundray::benchmark {
namespace {

using namespace std::chrono_literals;

// Positions with the median (60 %) and the lowest (18 %) fraction of returned pulses among 100
// random positions on this ground. Rays that miss are cheap for Embree, but cost the scan as much
// as others.
constexpr glm::dvec2 typical_place(5000, -1000);
constexpr glm::dvec2 ridge(0, 0);

// A swaying trajectory at 10 m/s.
Trajectory ride_from(const glm::dvec2& start) {
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 100; ++k) {
    const glm::dvec2 p = start + glm::dvec2(0.1 * k, 0.02 * k);
    samples.push_back(
        {10ms * k,
         {rotation_from_yaw_pitch_roll(0.2, 0.05 * std::sin(0.1 * k), 0.05 * std::cos(0.1 * k)),
          {p, *mountains().height_m_at(p) + 2.5}}});
  }
  return Trajectory(std::move(samples));
}

Scene bare_mountains(Tracing tracing) {
  return {RayTracer({full_resolution_level(mountains())}, {0, 0, 0}, tracing), {}};
}

LidarSpec vls128() { return load_lidar(testing::data_folder() / "sensors/velodyne_vls128.yaml"); }

// The rays of one sweep, beam by beam in blocks of 32 firing sequences: the most coherent order for
// packets.
std::vector<Ray> rays_of_sweep(const ScanPattern& pattern, const Trajectory& ride, double far_m) {
  PulseBatch pulses;
  pattern.fill(0, 0, pattern.pulses(0), pulses);
  std::vector<Pose> poses(pulses.size());
  for (const PulseBatch::Volley& volley : pulses.volleys) {
    const std::chrono::nanoseconds time(std::llround(1e9 * volley.time_s));
    std::fill(poses.begin() + static_cast<std::ptrdiff_t>(volley.begin),
              poses.begin() + static_cast<std::ptrdiff_t>(volley.end), ride.pose_at(time));
  }
  std::vector<Ray> rays;
  rays.reserve(pulses.size());
  const auto stride = static_cast<std::size_t>(pattern.neighbour_stride());
  for (std::size_t block = 0; block < pulses.size(); block += 32 * stride) {
    const std::size_t end = std::min(pulses.size(), block + 32 * stride);
    for (std::size_t shot = block; shot < block + stride; ++shot) {
      for (std::size_t i = shot; i < end; i += stride)
        rays.push_back(
            {poses[i] * pulses.origin_m[i], poses[i].rotation * pulses.direction[i], far_m});
    }
  }
  return rays;
}

// Writes the rays and samples as raw doubles and floats, so that other programs can trace the same
// input; see open3d_baseline.py.
void export_rays(const std::filesystem::path& folder, std::span<const Ray> rays) {
  std::filesystem::create_directories(folder);
  std::ofstream samples(folder / "heights.f32", std::ios::binary);
  const auto heights_m = mountains().heights_m();
  samples.write(reinterpret_cast<const char*>(heights_m.data()),
                static_cast<std::streamsize>(heights_m.size_bytes()));
  std::ofstream out(folder / "rays.f64", std::ios::binary);
  for (const Ray& ray : rays) {
    out.write(reinterpret_cast<const char*>(&ray.origin), sizeof(ray.origin));
    out.write(reinterpret_cast<const char*>(&ray.direction), sizeof(ray.direction));
  }
  std::ofstream frame(folder / "frame.txt");
  frame.precision(17);
  frame << mountains().columns() << ' ' << mountains().rows() << ' ' << mountains().origin_m().x
        << ' ' << mountains().origin_m().y << ' ' << mountains().step_m().x << ' '
        << mountains().step_m().y << '\n';
}

void scan_vls128(::benchmark::State& state, const glm::dvec2& place) {
  const Trajectory ride = ride_from(place);
  const LidarSpec spec = vls128();
  const Lidar lidar(spec);
  const Scene simulation = bare_mountains(Tracing::Fast);
  const auto rays = rays_of_sweep(lidar.pattern(), ride, spec.gate.far_m);
  if (const char* folder = std::getenv("GROUNDRAY_BENCH_EXPORT")) export_rays(folder, rays);
  RawEmbree raw(mountains(), rays);

  std::size_t met = 0;
  for (const float range_m : raw.trace()) met += range_m < spec.gate.far_m ? 1 : 0;
  const std::size_t rows = lidar.scan(simulation, ride, 0, Seed{7}, 0).echoes.rows();
  // Single precision alone decides differently at silhouettes, and where a hit lies within a
  // float's precision of the range gate.
  if (std::abs(static_cast<double>(met) - static_cast<double>(rows)) >
      1e-4 * static_cast<double>(rows)) {
    return state.SkipWithError("the scan and raw Embree disagree on how many rays hit");
  }
  double raw_s = 0, scan_s = 0;
  for (auto _ : state) {
    auto begin = Clock::now();
    ::benchmark::DoNotOptimize(raw.trace());
    raw_s += seconds_since(begin);
    begin = Clock::now();
    ::benchmark::DoNotOptimize(lidar.scan(simulation, ride, 0, Seed{7}, 0));
    const double this_s = seconds_since(begin);
    scan_s += this_s;
    state.SetIterationTime(this_s);
  }
  const double traced = static_cast<double>(rays.size()) * static_cast<double>(state.iterations());
  state.counters["returns"] = static_cast<double>(rows) / static_cast<double>(rays.size());
  state.counters["Mrays/s"] = 1e-6 * traced / scan_s;
  state.counters["raw_Mrays/s"] = 1e-6 * traced / raw_s;
  state.counters["of_raw"] = raw_s / scan_s;
}
BENCHMARK_CAPTURE(scan_vls128, typical, typical_place)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(4);
BENCHMARK_CAPTURE(scan_vls128, ridge, ridge)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(4);

void exact_against_fast(::benchmark::State& state) {
  const Trajectory ride = ride_from(typical_place);
  const LidarSpec spec = vls128();
  const auto rays = rays_of_sweep(ScanPattern(spec.pattern), ride, spec.gate.far_m);
  const Lidar lidar(spec);
  const Scene fast = bare_mountains(Tracing::Fast);
  const Scene exact = bare_mountains(Tracing::Exact);
  const PointCloud a = lidar.scan(fast, ride, 0, Seed{7}, 0).echoes;
  const PointCloud b = lidar.scan(exact, ride, 0, Seed{7}, 0).echoes;
  if (std::abs(static_cast<double>(a.rows()) - static_cast<double>(b.rows())) >
      5e-6 * static_cast<double>(rays.size()) + 1) {
    return state.SkipWithError("exact and fast tracing disagree");
  }
  double fast_s = 0, exact_s = 0;
  for (auto _ : state) {
    auto begin = Clock::now();
    ::benchmark::DoNotOptimize(lidar.scan(fast, ride, 0, Seed{7}, 0));
    fast_s += seconds_since(begin);
    begin = Clock::now();
    ::benchmark::DoNotOptimize(lidar.scan(exact, ride, 0, Seed{7}, 0));
    const double this_s = seconds_since(begin);
    exact_s += this_s;
    state.SetIterationTime(this_s);
  }
  state.counters["Mrays/s"] =
      1e-6 * static_cast<double>(rays.size()) * static_cast<double>(state.iterations()) / exact_s;
  state.counters["of_fast"] = fast_s / exact_s;
}
BENCHMARK(exact_against_fast)->UseManualTime()->Unit(::benchmark::kMillisecond)->MinTime(4);

}  // namespace
}  // namespace groundray::benchmark
