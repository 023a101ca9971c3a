// Generated ground: CPU time of making the images, and the cost of lookups without a period.
#include <benchmark/benchmark.h>

#include <cstddef>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>

#include "core/appearance/tiling.h"
#include "terrain/textures/ground_images.h"
#include "test/benchmark/timing.h"

namespace groundray::benchmark {
namespace {

void ground_images(::benchmark::State& state) {
  const auto kind = static_cast<GroundImageKind>(state.range(0));
  state.SetLabel(std::string(ground_image_names()[static_cast<std::size_t>(state.range(0))]));
  double cpu_s = 0;
  for (auto _ : state) {
    cpu_s += processor_s_of(
        [&] { ::benchmark::DoNotOptimize(make_ground_images({.kind = kind}).height_m.values()); });
  }
  state.counters["cpu_s"] = cpu_s / static_cast<double>(state.iterations());
}
BENCHMARK(ground_images)
    ->DenseRange(0, static_cast<int>(ground_image_names().size()) - 1)
    ->Unit(::benchmark::kMillisecond);

// Alternates with repeated copies, at places and footprints of a camera's pixels on the ground.
void stochastic_tiling(::benchmark::State& state) {
  const Texture texture(
      make_ground_images({.kind = GroundImageKind::ForestLitter, .pixels = 1024}).albedo,
      Encoding::Srgb, Wrap::Repeat);
  const auto sum_of = [&](Tiling tiling) {
    glm::vec3 sum(0);
    for (int i = 0; i < 500'000; ++i) {
      const double far = 1 + 1e-4 * i;
      const glm::dvec2 uv(0.61803398875 * i, far);
      sum += tiled_color(texture, uv, {{1e-3 * far, 0}, {0, 1e-3 * far * far}}, Filtering::Fast,
                         tiling);
    }
    return sum;
  };
  double repeat_s = 0, stochastic_s = 0;
  for (auto _ : state) {
    repeat_s += processor_s_of([&] { ::benchmark::DoNotOptimize(sum_of(Tiling::Repeat)); });
    stochastic_s += processor_s_of([&] { ::benchmark::DoNotOptimize(sum_of(Tiling::Stochastic)); });
  }
  const glm::vec3 difference =
      (sum_of(Tiling::Stochastic) - sum_of(Tiling::Repeat)) / sum_of(Tiling::Repeat);
  if (glm::abs(difference.g) > 0.01f) return state.SkipWithError("the mean colours differ");
  state.counters["of_repeat"] = stochastic_s / repeat_s;
}
BENCHMARK(stochastic_tiling)->MinTime(2);

}  // namespace
}  // namespace groundray::benchmark
