// Cost of lidars: with simulated light compared with the rays alone, which run alternately in every
// iteration so that their ratio is measured under the same load; and pulses per second of CPU time.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "apps/scene/readers/scene_reader.h"
#include "sensors/lidar/beam/pulse_tracer.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/benchmark/landscape.h"
#include "test/benchmark/raw_embree.h"
#include "test/benchmark/timing.h"
#include "test/support/temporary_folder.h"

namespace groundray::benchmark {
namespace {

using namespace std::chrono_literals;

Scene lidar_hills() {
  const Material soil{"soil", Lambertian{{{400, 0.3}, {2000, 0.3}}}};
  return {RayTracer({full_resolution_level(hills())}, {0, 0, 0}, Tracing::Fast), {}, {soil}};
}

// A straight, swaying trajectory.
Trajectory path_at(double height_m, double speed_m_s) {
  const double z_m = *hills().height_m_at({0, 0}) + height_m;
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 100; ++k) {
    samples.push_back(
        {10ms * k,
         {rotation_from_yaw_pitch_roll(0.2, 0.05 * std::sin(0.1 * k), 0.05 * std::cos(0.1 * k)),
          {0.01 * k * speed_m_s, 0, z_m}}});
  }
  return Trajectory(std::move(samples));
}

// A lidar, without simulated light, and its trajectory.
struct Ride {
  LidarSpec spec;
  Trajectory X_DS;
};

// 120 000 pulses of a spinning lidar on a mast, 20 turns per second; 97 % of the pulses hit the
// ground.
Ride driven_ride() {
  LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vls128.yaml");
  std::get<SpinningPattern>(spec.pattern).rate_hz = 20;
  return {spec, path_at(4, 10)};
}

// 79 600 pulses of a polygon scanner 800 m above the ground; all of them hit it.
Ride flown_ride() {
  LidarSpec spec;
  spec.pattern = LinePattern{.mirror = LinePattern::Mirror::Polygon,
                             .plane = LinePattern::Plane::Across,
                             .from_rad = -0.5,
                             .to_rad = 0.5,
                             .line_rate_hz = 200,
                             .pulse_rate_hz = 1e6,
                             .facets = 4,
                             .lines_per_sweep = 50};
  spec.gate = {100, 2000};
  return {spec, path_at(800, 60)};
}

// A laser diode and an avalanche photodiode in clear air; not a particular product.
LidarSpec with_light(LidarSpec spec, double pulse_energy_j) {
  spec.beam = {.divergence_rad = {3e-3, 1.5e-3}, .sub_rays = 16, .most_sub_rays = 16};
  spec.light = {.wavelength_nm = 905,
                .optics = {.pulse_energy_j = pulse_energy_j, .aperture_diameter_m = 0.025},
                .pulse = {.fwhm_s = 5e-9},
                .receiver = {.response_fwhm_s = 3e-9,
                             .timing = ReceiverSpec::Timing::ConstantFraction,
                             .returns = ReceiverSpec::Returns::Dual,
                             .noise = NoiseSpec{.nep_w_per_sqrt_hz = 1e-13,
                                                .wavelength_m = 905e-9,
                                                .quantum_efficiency = 0.8,
                                                .excess_noise_factor = 3,
                                                .false_alarm_rate_hz = 100}}};
  return spec;
}

// The sub-rays of sweep 0 as a lidar casts them.
std::vector<Ray> sub_rays_of(const Ride& ride, const Scene& scene) {
  const ScanPattern pattern(ride.spec.pattern);
  const LaserBeam beam(ride.spec.beam);
  const PulseTracer::Settings settings{.beam = beam, .far_m = ride.spec.gate.far_m};
  std::vector<Ray> rays;
  PulseTracer cast;
  const std::int64_t per_cast = 2048 / ride.spec.beam.sub_rays;
  for (std::int64_t begin = 0; begin < pattern.pulses(0); begin += per_cast) {
    const std::int64_t end = std::min(begin + per_cast, pattern.pulses(0));
    cast.cast({pattern, ride.X_DS}, begin, end, settings, {}, scene);
    rays.insert(rays.end(), cast.all_rays().begin(), cast.all_rays().end());
  }
  return rays;
}

// Sums the time of one part of each iteration, s.
struct Stopwatch {
  double wall_s = 0, cpu_s = 0;
  template <typename Act>
  double time(const Act& act) {
    const double cpu_begin_s = processor_s();
    const auto begin = Clock::now();
    act();
    const double this_s = seconds_since(begin);
    wall_s += this_s;
    cpu_s += processor_s() - cpu_begin_s;
    return this_s;
  }
};

void run(::benchmark::State& state, const Ride& ride, const Scene& simulation, RawEmbree& raw,
         std::size_t rays) {
  const Lidar lidar(ride.spec, {.visibility_m = 23e3});
  Stopwatch of_raw, of_scan;
  for (auto _ : state) {
    of_raw.time([&] { ::benchmark::DoNotOptimize(raw.trace()); });
    state.SetIterationTime(of_scan.time(
        [&] { ::benchmark::DoNotOptimize(lidar.scan(simulation, ride.X_DS, 0, Seed{7}, 0)); }));
  }
  const double scans = static_cast<double>(state.iterations());
  const double pulses = static_cast<double>(lidar.pattern().pulses(0)) * scans;
  state.counters["Mpulses/CPU-s"] = 1e-6 * pulses / of_scan.cpu_s;
  state.counters["Mrays/s"] = 1e-6 * static_cast<double>(rays) * scans / of_scan.wall_s;
  state.counters["raw_Mrays/s"] = 1e-6 * static_cast<double>(rays) * scans / of_raw.wall_s;
  state.counters["of_raw"] = of_raw.wall_s / of_scan.wall_s;
  state.counters["of_raw_cpu"] =
      of_raw.cpu_s / of_scan.cpu_s;  // CPU time: independent of other load
}

bool agree(double a, double b, double tolerance) { return std::abs(a - b) <= tolerance * b; }

void lidar_one_ray(::benchmark::State& state, Ride (*ride_of)()) {
  const Ride ride = ride_of();
  const Scene simulation = lidar_hills();
  const auto rays = sub_rays_of(ride, simulation);
  RawEmbree raw(hills(), rays);
  const RangeGate gate = ride.spec.gate;
  const double met = static_cast<double>(std::ranges::count_if(
      raw.trace(), [&](float range_m) { return gate.near_m <= range_m && range_m <= gate.far_m; }));
  const auto rows = Lidar(ride.spec).scan(simulation, ride.X_DS, 0, Seed{7}, 0).echoes.rows();
  // Single precision alone decides differently at silhouettes, and where a hit lies within a
  // float's precision of the range gate.
  if (!agree(static_cast<double>(rows), met, 1e-4))
    return state.SkipWithError("the scan and raw Embree disagree on how many rays hit");
  state.counters["returns"] = static_cast<double>(rows) / static_cast<double>(rays.size());
  run(state, ride, simulation, raw, rays.size());
}

BENCHMARK_CAPTURE(lidar_one_ray, driven, driven_ride)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);
BENCHMARK_CAPTURE(lidar_one_ray, flown, flown_ride)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);

// Errors of the reported ranges where a single surface made the echo.
struct Errors {
  double mean_m = 0, rms_m = 0;
};

Errors errors_of(const PointCloud& echoes) {
  const auto x = echoes.column<float>("x"), y = echoes.column<float>("y"),
             z = echoes.column<float>("z"), share = echoes.column<float>("share");
  const auto truth_m = echoes.column<double>("range_true");
  double count = 0, sum_m = 0, sum_m2 = 0;
  for (std::size_t i = 0; i < echoes.rows(); ++i) {
    if (share[i] != 1) continue;
    const double error_m = std::hypot(x[i], y[i], z[i]) - truth_m[i];
    count += 1, sum_m += error_m, sum_m2 += error_m * error_m;
  }
  return {sum_m / count, std::sqrt(sum_m2 / count)};
}

// Nearly all echoes here are far above the noise. Noise hides or causes few of them and moves their
// mean by less than 5 mm: its standard deviation of centimetres over the root of 80 000. On a slope
// the timed edge precedes the centroid by less than a quarter of the received pulse's width, 0.2 m.
const char* scan_fault(const Ride& ride, const Scene& simulation) {
  const auto scan = [&](const LidarSpec& spec) {
    return Lidar(spec).scan(simulation, ride.X_DS, 0, Seed{7}, 0).echoes;
  };
  LidarSpec quiet = ride.spec;
  quiet.light->receiver.threshold_w = 5e-9;
  quiet.light->receiver.noise.reset();
  LidarSpec one_ray = ride.spec;
  one_ray.light.reset();
  one_ray.beam = {};
  one_ray.waveforms = LidarSpec::WaveformOutput::Omit;
  const PointCloud noisy = scan(ride.spec), exact = scan(quiet);
  if (!agree(static_cast<double>(noisy.rows()), static_cast<double>(exact.rows()), 0.01))
    return "noise changes the number of echoes by more than 1 %";
  const auto index = noisy.column<std::uint8_t>("return_index");
  const auto first = static_cast<double>(std::ranges::count(index, std::uint8_t{1}));
  if (!agree(first, static_cast<double>(scan(one_ray).rows()), 0.01))
    return "pulses with echoes differ by more than 1 % from rays that hit";
  const Errors with = errors_of(noisy), without = errors_of(exact);
  if (std::abs(with.mean_m - without.mean_m) > 0.005) return "noise moves the mean range";
  if (with.rms_m > 0.2) return "ranges are further from the truth than any slope explains";
  return nullptr;
}

void lidar_light(::benchmark::State& state, Ride (*ride_of)(), double pulse_energy_j,
                 LidarSpec::WaveformOutput waveforms) {
  Ride ride = ride_of();
  ride.spec = with_light(ride.spec, pulse_energy_j);
  ride.spec.waveforms = waveforms;
  const Scene simulation = lidar_hills();
  const auto rays = sub_rays_of(ride, simulation);
  RawEmbree raw(hills(), rays);
  if (const char* fault = scan_fault(ride, simulation)) return state.SkipWithError(fault);
  run(state, ride, simulation, raw, rays.size());
}
using WaveformOutput = LidarSpec::WaveformOutput;
BENCHMARK_CAPTURE(lidar_light, driven, driven_ride, 100e-9, WaveformOutput::Omit)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);
BENCHMARK_CAPTURE(lidar_light, driven_waveforms, driven_ride, 100e-9, WaveformOutput::Keep)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);
BENCHMARK_CAPTURE(lidar_light, flown, flown_ride, 100e-6, WaveformOutput::Omit)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);

}  // namespace
}  // namespace groundray::benchmark
