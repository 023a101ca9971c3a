// Points fused per second of CPU time, including their passage through the temporary file but not
// their generation.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdint>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "test/benchmark/timing.h"

namespace groundray::benchmark {
namespace {

// Points of 5 scans and 15 stereo pairs over a square of gentle hills, with noise and 1.5 %
// outliers, block by block. Uses a small random generator, since Philox would take longer than the
// fusion.
class Survey {
 public:
  Survey(std::uint64_t points, double half_m) : points_(points), half_m_(half_m) {}

  static double height_m(double x, double y) {
    const double u = 0.05 * x - std::floor(0.05 * x), v = 0.04 * y - std::floor(0.04 * y);
    return 8 * (u * u * (1 - u) * (1 - u) + v * v * (1 - v) * (1 - v));
  }
  bool next(MeasuredPoints& block) {
    const double begin_s = processor_s();
    const std::uint64_t left = points_ - given_;
    resize(block, static_cast<std::size_t>(std::min<std::uint64_t>(left, 1U << 14U)));
    for (std::size_t i = 0; i < block.size(); ++i) set(block, i, given_ + i);
    given_ += block.size();
    seconds_ += processor_s() - begin_s;
    return block.size() > 0;
  }
  double seconds() const { return seconds_; }

 private:
  static void resize(MeasuredPoints& block, std::size_t count) {
    block.p_m.resize(count);
    block.sd_m.resize(count);
    block.bias_sd_m.resize(count);
    block.lean.resize(count);
    block.across_sd_m.resize(count);
    block.groups.resize(count);
    block.origins.resize(count);
  }
  // @see Marsaglia, Xorshift RNGs (2003).
  double uniform() {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 7U;
    state_ ^= state_ << 17U;
    return static_cast<double>(state_ >> 11U) * 0x1p-53;
  }
  void set(MeasuredPoints& block, std::size_t i, std::uint64_t number) {
    const auto group = static_cast<std::uint32_t>(number * 20 / points_);
    const bool is_lidar = group < 5;
    const double x = (2 * uniform() - 1) * half_m_, y = (2 * uniform() - 1) * half_m_;
    const double noise =
        1.732 * (uniform() + uniform() + uniform() + uniform() - 2);  // nearly normal
    const double sd_m = is_lidar ? 0.02 : 0.03 + 0.05 * uniform();
    double z = height_m(x, y) + sd_m * noise;
    if (uniform() < 0.015) z += 4 * (uniform() - 0.5);
    block.p_m[i] = {x, y, z};
    block.sd_m[i] = static_cast<float>(sd_m);
    block.bias_sd_m[i] = is_lidar ? 0.004F : 0.02F;
    block.lean[i] = {static_cast<float>(group % 3) - 1, 0.1F * static_cast<float>(group)};
    block.across_sd_m[i] = 0.02F;
    block.groups[i] = group;
    block.origins[i] = is_lidar ? PointOrigin::Lidar : PointOrigin::Stereo;
  }

  std::uint64_t points_, given_ = 0;
  double half_m_, seconds_ = 0;
  std::uint64_t state_ = 88172645463325252U;
};

double rms_error_m(const DemLayers& layers) {
  double sum = 0, count = 0;
  std::size_t i = 0;
  for (int row = 0; row < layers.frame.samples.y; ++row) {
    for (int column = 0; column < layers.frame.samples.x; ++column, ++i) {
      if (std::isnan(layers.elevation_m[i])) continue;
      const glm::dvec2 p = layers.frame.to_D({column, row});
      sum += std::pow(double{layers.elevation_m[i]} - Survey::height_m(p.x, p.y), 2);
      count += 1;
    }
  }
  return std::sqrt(sum / count);
}

void fuse_survey(::benchmark::State& state) {
  const auto points = static_cast<std::uint64_t>(state.range(0)) * 1'000'000;
  const double half_m = static_cast<double>(state.range(1));
  const GridFrame frame = frame_over({{-half_m, -half_m}, {half_m, half_m}}, 0.25);
  double seconds = 0, on_disk = 0;
  for (auto _ : state) {
    Survey survey(points, half_m);
    const double begin_s = processor_s();
    const Fusion fusion = fuse([&](MeasuredPoints& block) { return survey.next(block); }, frame);
    const double this_s = processor_s() - begin_s - survey.seconds();
    if (!(rms_error_m(fusion.layers) < 0.03))
      return state.SkipWithError("the fused heights are not those of the ground");
    on_disk = 1e-6 * static_cast<double>(fusion.counts.bytes_on_disk);
    seconds += this_s;
    state.SetIterationTime(this_s);
  }
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  state.counters["Mpoints/cpu-s"] =
      1e-6 * static_cast<double>(points) * static_cast<double>(state.iterations()) / seconds;
  state.counters["MB_on_disk"] = on_disk;
  state.counters["peak_MB"] = static_cast<double>(used.ru_maxrss) / 1024;
}
BENCHMARK(fuse_survey)
    ->Args({10, 50})    // 60 points per cell
    ->Args({10, 125})   // 10
    ->Args({100, 125})  // 100, beyond memory
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond);

}  // namespace
}  // namespace groundray::benchmark
