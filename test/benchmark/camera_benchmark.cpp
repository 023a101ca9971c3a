// Cost of cameras: an image's truth compared with its rays alone, path-traced light, and the table
// of pixel directions. Compared variants run alternately in every iteration, so that their ratio is
// measured under the same load. Times are CPU times of all threads.
#include <benchmark/benchmark.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "sensors/camera/image_truth.h"
#include "sensors/camera/path_tracer.h"
#include "terrain/terrain_scene.h"
#include "test/benchmark/landscape.h"
#include "test/benchmark/raw_embree.h"
#include "test/benchmark/timing.h"
#include "test/support/scans/camera_scene.h"

namespace groundray::benchmark {
namespace {

using namespace std::chrono_literals;

constexpr glm::ivec2 size_px(1920, 1080);
constexpr double pixels = static_cast<double>(size_px.x) * size_px.y;
constexpr double albedo = 0.4;

Scene grey_hills() {
  const Material soil{"soil", Lambertian{{{300, albedo}, {2500, albedo}}}};
  return {RayTracer({full_resolution_level(hills())}, {0, 0, 0}, Tracing::Fast), {}, {soil}};
}

// A pinhole camera with a field of view of 64 degrees, and its pose.
struct View {
  Camera camera;
  Trajectory X_DC;
};

View view(const glm::dvec3& from, const glm::dvec3& to) {
  CameraSpec spec;
  spec.size_px = size_px;
  spec.lens = Pinhole{{glm::dvec2(1536), (glm::dvec2(size_px) - 1.0) / 2.0, 0}};
  spec.sampling = {.samples = 4, .most_samples = 4, .depth = 3};
  const Pose X_DC = testing::looking(from, to);
  return {Camera(spec), Trajectory({{0s, X_DC}, {1s, X_DC}})};
}

// Two metres above the ground, looking slightly down.
View driven_view() {
  const glm::dvec3 from(0, 0, *hills().height_m_at({0, 0}) + 2);
  return view(from, from + glm::dvec3(1, 0.2, -0.2));
}

// Above a corner, looking over the whole landscape.
View flown_view() {
  const double half_m = -hills().origin_m().x;
  return view({-0.7 * half_m, -0.7 * half_m, hills().max_height_m() + 0.1 * half_m},
              {0.1 * half_m, 0.1 * half_m, hills().min_height_m()});
}

// Rays through the pixel centres.
std::vector<Ray> pixel_rays(const View& view) {
  const Pose X_DC = view.X_DC.pose_at(0s);
  std::vector<Ray> rays;
  for (const glm::dvec3& direction : view.camera.directions())
    rays.push_back({X_DC.translation_m, X_DC.rotation * direction});
  return rays;
}

// As image_truth does: on all cores, in batches that fit into the cache.
void trace(const Scene& simulation, std::span<const Ray> rays, std::span<Hit> hits) {
  constexpr std::size_t at_once = 256;
  tbb::parallel_for(std::size_t{0}, (rays.size() + at_once - 1) / at_once, [&](std::size_t batch) {
    const std::size_t begin = batch * at_once, count = std::min(at_once, rays.size() - begin);
    simulation.trace(rays.subspan(begin, count), hits.subspan(begin, count));
  });
}

// Single precision alone errs by some tenths of a millimetre, by more along slanting rays, and
// decides differently at silhouettes.
const char* truth_fault(const ImageTruth& truth, std::span<const float> raw_m) {
  double differ = 0;
  for (std::size_t i = 0; i < raw_m.size(); ++i) {
    const float range_m = truth.range_m.values()[i];
    const glm::dvec3 p_DQ(truth.p_DQ.values()[3 * i], truth.p_DQ.values()[3 * i + 1],
                          truth.p_DQ.values()[3 * i + 2]);
    const bool is_sky = std::isinf(range_m);
    if (is_sky != std::isinf(raw_m[i]) ||
        (!is_sky && std::abs(range_m - raw_m[i]) > 0.01f + 1e-4f * range_m))
      differ += 1;
    if (!is_sky && std::abs(*hills().height_m_at({p_DQ.x, p_DQ.y}) - p_DQ.z) > 1e-5)
      return "points of the truth are off the ground";
  }
  return differ > 1e-4 * pixels ? "the truth and raw Embree disagree" : nullptr;
}

void camera_truth(::benchmark::State& state, View (*view_of)()) {
  const View view = view_of();
  const Scene simulation = grey_hills();
  const auto rays = pixel_rays(view);
  RawEmbree raw(hills(), rays);
  std::vector<Hit> hits(rays.size());
  ImageTruth truth;
  const auto tell = [&] {
    truth = image_truth(view.camera, simulation, simulation.materials.in_colour(), view.X_DC, {},
                        std::move(truth));
  };
  tell();
  if (const char* fault = truth_fault(truth, raw.trace())) return state.SkipWithError(fault);
  double raw_s = 0, trace_s = 0, truth_s = 0;
  for (auto _ : state) {
    raw_s += processor_s_of([&] { ::benchmark::DoNotOptimize(raw.trace()); });
    trace_s += processor_s_of([&] { trace(simulation, rays, hits); });
    const double this_s = processor_s_of(tell);
    state.SetIterationTime(this_s);
    truth_s += this_s;
  }
  const auto met = static_cast<double>(std::ranges::count_if(hits, &Hit::operator bool));
  const double images = static_cast<double>(state.iterations());
  state.counters["ground"] = met / pixels;
  state.counters["Mrays/CPU-s"] = 1e-6 * pixels * images / truth_s;
  state.counters["of_raw"] = raw_s / truth_s;
  state.counters["of_trace"] = trace_s / truth_s;
  state.counters["trace_of_raw"] = raw_s / trace_s;
}
BENCHMARK_CAPTURE(camera_truth, driven, driven_view)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);
BENCHMARK_CAPTURE(camera_truth, flown, flown_view)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(2);

const Sky& sky() {
  static const Sky sky(
      {ConstantSky{{30, 40, 60}}, SunSpec{SunAngles{.azimuth_deg = 130, .elevation_deg = 30}}});
  return sky;
}

// Cosine-weighted random direction about `normal`.
glm::dvec3 by_cosine(const glm::dvec3& normal, std::uint32_t number) {
  const glm::dvec2 u = random_uniform({.seed = {5}, .pulse = number});
  const double z = 1 - 2 * u.x, turn = 2 * std::numbers::pi * u.y, side = std::sqrt(1 - z * z);
  return glm::normalize(normal + glm::dvec3(side * std::cos(turn), side * std::sin(turn), z));
}

// Green light along each ray that comes from the sky directly or via one surface: by raw Embree,
// with one ray to the centre of the sun and one to a random point of the dome.
std::vector<double> direct_light(const Scene& simulation, std::span<const Ray> rays) {
  std::vector<Hit> hits(rays.size());
  simulation.trace(rays, hits);
  const Sun& sun = *sky().sun();
  std::vector<Ray> shadow;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const glm::dvec3 normal(hits[i] ? hits[i].normal : glm::vec3(0, 0, 1));
    const glm::dvec3 p =
        rays[i].origin + rays[i].direction * (hits[i] ? hits[i].range_m : 0) + 0.01 * normal;
    shadow.push_back({p, sun.direction()});
    shadow.push_back({p, by_cosine(normal, static_cast<std::uint32_t>(i))});
  }
  RawEmbree raw(hills(), shadow);
  const auto met_m = raw.trace();
  const double dome = sky().dome_radiance({0, 0, 1}).y;
  std::vector<double> light;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double cosine = std::max(glm::dot(glm::dvec3(hits[i].normal), sun.direction()), 0.0);
    const double by_sun = sun.irradiance().y * cosine * std::isinf(met_m[2 * i]) / std::numbers::pi;
    const double by_dome = dome * std::isinf(met_m[2 * i + 1]);
    light.push_back(hits[i] ? albedo * (by_sun + by_dome) : dome);
  }
  return light;
}

// Compares some ten thousand rays: means must agree within five standard errors, p = 6e-7.
const char* light_fault(const View& view, const Scene& simulation) {
  std::vector<Ray> rays;
  const auto all = pixel_rays(view);
  for (std::size_t i = 0; i < all.size(); i += 97) rays.push_back(all[i]);
  const auto light_of = [&](int depth) {
    PathTracer::Workspace work;
    for (std::uint32_t i = 0; i < rays.size(); ++i)
      work.add(rays[i], SobolPairs(SobolPairs::mixed(i), 0));
    std::vector<glm::vec3> radiance(rays.size());
    PathTracer(simulation, sky(), depth, std::nullopt).trace(work, radiance);
    return radiance;
  };
  const auto direct = light_of(2), bounced = light_of(3);
  const auto expected = direct_light(simulation, rays);
  double sum = 0, squares = 0, more = 0, all_light = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double difference = double{direct[i].y} - expected[i];
    sum += difference;
    squares += difference * difference;
    more += double{bounced[i].y} - double{direct[i].y};
    all_light += expected[i];
  }
  if (std::abs(sum) > 5 * std::sqrt(squares)) return "sun and sky are not what raw Embree finds";
  const bool is_bounced = 0 < more && more < albedo * all_light;
  return is_bounced ? nullptr : "the light of the second surface is missing, or too much";
}

void camera_light(::benchmark::State& state, View (*view_of)()) {
  const View view = view_of();
  const Scene simulation = grey_hills();
  if (const char* fault = light_fault(view, simulation)) return state.SkipWithError(fault);
  RawEmbree raw(hills(), pixel_rays(view));
  const SamplingSpec& sampling = view.camera.spec().sampling;
  const PathTracer light(simulation, sky(), sampling.depth, std::nullopt);
  double raw_s = 0, light_s = 0;
  for (auto _ : state) {
    raw_s += processor_s_of([&] { ::benchmark::DoNotOptimize(raw.trace()); });
    const double this_s = processor_s_of(
        [&] { ::benchmark::DoNotOptimize(view.camera.expose(light, view.X_DC, 0s, {Seed{7}})); });
    state.SetIterationTime(this_s);
    light_s += this_s;
  }
  const double paths = pixels * sampling.samples * static_cast<double>(state.iterations());
  const auto met = raw.trace();
  state.counters["ground"] =
      1 - static_cast<double>(std::ranges::count_if(met, [](float m) { return std::isinf(m); })) /
              pixels;
  state.counters["Mpaths/CPU-s"] = 1e-6 * paths / light_s;
  state.counters["raw_Mrays/CPU-s"] = 1e-6 * paths / sampling.samples / raw_s;
}
BENCHMARK_CAPTURE(camera_light, driven, driven_view)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(4);
BENCHMARK_CAPTURE(camera_light, flown, flown_view)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond)
    ->MinTime(4);

// All fourteen coefficients. At the shorter focal length the distortion folds over within the
// image.
void camera_table(::benchmark::State& state) {
  const auto focal_px = static_cast<double>(state.range(0));
  const double tau_x_rad = 0.035, tau_y_rad = -0.052;
  const Lens lens(BrownConrady{{glm::dvec2(focal_px), (glm::dvec2(size_px) - 1.0) / 2.0, 0},
                               {-0.30, 0.12, 1e-3, -5e-4, -0.02, 0.01, 0.02, 0, 1e-3, 5e-4, -1e-3,
                                2e-4, tau_x_rad, tau_y_rad},
                               sensor_homography(tau_x_rad, tau_y_rad)},
                  size_px);
  std::vector<PixelRay> rays(static_cast<std::size_t>(pixels));
  lens.fill(0, size_px.y, rays);
  double look = 0, farthest_px = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays[i].direction == glm::dvec3(0)) continue;
    const auto at = lens.project(rays[i].direction);
    if (!at) return state.SkipWithError("a pixel looks where the lens images nothing");
    const glm::dvec2 pixel(i % size_px.x, i / size_px.x);
    farthest_px = std::max(farthest_px, glm::distance(*at, pixel));
    look += 1;
  }
  if (farthest_px > 1e-9) return state.SkipWithError("rays are not imaged at their pixels");
  for (auto _ : state)
    state.SetIterationTime(processor_s_of([&] { lens.fill(0, size_px.y, rays); }));
  state.counters["look"] = look / pixels;
  state.counters["farthest_px"] = farthest_px;
}
BENCHMARK(camera_table)
    ->ArgName("focal_px")
    ->Arg(1500)
    ->Arg(1000)
    ->UseManualTime()
    ->Unit(::benchmark::kMillisecond);

}  // namespace
}  // namespace groundray::benchmark
