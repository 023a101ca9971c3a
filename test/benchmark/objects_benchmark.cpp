// Cost of objects: build time and memory of a million plants, lidar rays among them compared with
// the bare ground, and alpha-cut leaves compared with opaque ones. Compared variants run
// alternately in every iteration, so that their ratio is measured under the same load.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "apps/scene/readers/scene_reader.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/beam/pulse_tracer.h"
#include "sensors/lidar/lidar.h"
#include "terrain/assets/asset.h"
#include "terrain/assets/asset_sway.h"
#include "terrain/scatter/scatter.h"
#include "terrain/terrain_scene.h"
#include "test/benchmark/timing.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::benchmark {
namespace {

using namespace std::chrono_literals;

const HeightGrid& planted_ground() {
  static const HeightGrid grid = testing::fractal(1025, 1, 60, Seed{12345});
  return grid;
}

std::vector<PlacedObject> plants(double per_m2) {
  const Scatter scatter(planted_ground(), DensityMap(per_m2), {.scale = {0.5, 1.5}}, Seed{3});
  std::vector<PlacedObject> objects;
  for (const Placement& at : scatter.placements())
    objects.push_back({at.p_DO, at.R_DO, at.scale, at.prototype});
  return objects;
}

Scene planted_scene(Model model, std::vector<PlacedObject> objects) {
  const RayDevice device;
  std::vector<ModelScene> models{{device, std::move(model), Tracing::Fast}};
  const std::size_t surfaces = models[0].model().surfaces.size();
  return {RayTracer({full_resolution_level(planted_ground())}, {0, 0, 0}, Tracing::Fast),
          {.label = 1},
          {},
          {device, std::move(models), std::move(objects), {}},
          {{2, std::vector<std::uint16_t>(surfaces)}}};
}

// The rays of one sweep of a VLS-128 two metres above the ground.
std::vector<Ray> sweep_rays(const Scene& simulation) {
  const LidarSpec spec = load_lidar(testing::data_folder() / "sensors/velodyne_vls128.yaml");
  const ScanPattern pattern(spec.pattern);
  const LaserBeam beam(spec.beam);
  const Pose X_DS{{1, 0, 0, 0}, {0, 0, *planted_ground().height_m_at({0, 0}) + 2}};
  const Trajectory path({{0s, X_DS}, {1s, X_DS}});
  PulseTracer cast;
  cast.cast({pattern, path}, 0, pattern.pulses(0), {.beam = beam, .far_m = spec.gate.far_m}, {},
            simulation);
  return {cast.all_rays().begin(), cast.all_rays().end()};
}

// CPU time of tracing on one thread, s.
template <typename Trace>
double tracing_s(const Trace& trace, std::span<const Ray> rays, std::vector<Hit>& hits) {
  hits.resize(rays.size());
  const double begin_s = processor_s();
  trace(rays, hits);
  return processor_s() - begin_s;
}

// The design case of a lidar scene: one plant of about 2,000 triangles per square metre.
void objects_build(::benchmark::State& state) {
  const auto objects = plants(0.95);
  for (auto _ : state) {
    const RayDevice device;
    const double begin_s = processor_s();
    const ModelScene shrub(device, make_asset({.kind = AssetKind::Shrub}), Tracing::Fast);
    const ObjectTracer tracer(device, {shrub}, objects, {});
    state.SetIterationTime(processor_s() - begin_s);
    const auto count = static_cast<double>(objects.size());
    state.counters["objects"] = count;
    state.counters["triangles"] = static_cast<double>(shrub.model().mesh.triangles.size());
    state.counters["CPU_s"] = processor_s() - begin_s;
    state.counters["B_each"] =
        static_cast<double>(device.memory_bytes()) / count + sizeof(PlacedObject);
  }
}
BENCHMARK(objects_build)->UseManualTime()->Iterations(1)->Unit(::benchmark::kMillisecond);

void objects_among(::benchmark::State& state, AssetKind kind, double per_m2) {
  const Scene simulation = planted_scene(make_asset({.kind = kind}), plants(per_m2));
  const auto rays = sweep_rays(simulation);
  std::vector<Hit> hits, bare;
  double with_s = 0, without_s = 0;
  for (auto _ : state) {
    with_s += tracing_s([&](auto of, auto& into) { simulation.trace(of, into); }, rays, hits);
    without_s +=
        tracing_s([&](auto of, auto& into) { simulation.rays.trace(of, into); }, rays, bare);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].range_m > bare[i].range_m)
      return state.SkipWithError("an object took a ray further than the ground");
  }
  const double traced = static_cast<double>(rays.size()) * static_cast<double>(state.iterations());
  state.counters["Mrays/CPU-s"] = 1e-6 * traced / with_s;
  state.counters["of_bare"] = without_s / with_s;
  state.counters["on_objects"] = static_cast<double>(std::ranges::count_if(
                                     hits, [](const Hit& hit) { return hit.object != 0; })) /
                                 static_cast<double>(rays.size());
}
BENCHMARK_CAPTURE(objects_among, grass, AssetKind::GrassTuft, 0.95)->MinTime(2);
BENCHMARK_CAPTURE(objects_among, shrubs, AssetKind::Shrub, 0.05)->MinTime(2);
BENCHMARK_CAPTURE(objects_among, conifers, AssetKind::Conifer, 0.01)->MinTime(2);

// Plants that sway, compared with the same plants at rest; `wind` is the ratio of the CPU times.
void objects_in_wind(::benchmark::State& state, AssetKind kind, double per_m2) {
  const auto objects = plants(per_m2);
  const AssetSpec asset{.kind = kind};
  const Scene ground = planted_scene(make_asset(asset), objects);
  const auto rays = sweep_rays(ground);
  const RayDevice device;
  const std::vector<ModelScene> models{{device, make_asset(asset), Tracing::Fast}};
  const ObjectTracer still(device, models, objects, {});
  const ObjectTracer swaying(device, models, objects, {},
                             {Sway({.speed_m_s = 8}, asset_flexibility(asset))});
  std::vector<Hit> bare(rays.size()), hits;
  ground.rays.trace(rays, bare);
  double still_s = 0, swaying_s = 0;
  for (auto _ : state) {
    for (const ObjectTracer* const tracer : {&still, &swaying}) {
      hits = bare;
      const double begin_s = processor_s();
      tracer->trace(rays, hits);
      (tracer == &still ? still_s : swaying_s) += processor_s() - begin_s;
    }
  }
  double radius_m = 0;
  for (const glm::dvec3& p_O : models[0].model().mesh.vertices_m)
    radius_m = std::max(radius_m, glm::length(p_O));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].object == 0) continue;
    const PlacedObject at = swaying.placed_at(hits[i].object, rays[i].time);
    const glm::dvec3 arm = rays[i].origin + rays[i].direction * hits[i].range_m - at.p_DO;
    const Lean lean = swaying.lean(hits[i].object, rays[i].time);
    if (glm::length(lean.upright(arm)) > at.scale * radius_m * (1 + 1e-9))
      return state.SkipWithError("a ray hit a plant beside where it leans");
  }
  state.counters["wind"] = swaying_s / still_s;
}
BENCHMARK_CAPTURE(objects_in_wind, grass, AssetKind::GrassTuft, 0.95)->MinTime(2);
BENCHMARK_CAPTURE(objects_in_wind, meadow, AssetKind::GrassPatch, 0.5)->MinTime(2);
BENCHMARK_CAPTURE(objects_in_wind, shrubs, AssetKind::Shrub, 0.05)->MinTime(2);
BENCHMARK_CAPTURE(objects_in_wind, conifers, AssetKind::Conifer, 0.01)->MinTime(2);

void objects_alpha(::benchmark::State& state) {
  const auto objects = plants(0.01);
  Model whole = make_asset({.kind = AssetKind::Conifer});
  for (ModelSurface& surface : whole.surfaces) surface.least_alpha = 0;
  const Scene cut = planted_scene(make_asset({.kind = AssetKind::Conifer}), objects);
  const Scene opaque = planted_scene(std::move(whole), objects);
  const auto rays = sweep_rays(cut);
  std::vector<Hit> of_cut, of_opaque;
  double cut_s = 0, opaque_s = 0;
  for (auto _ : state) {
    cut_s += tracing_s([&](auto of, auto& into) { cut.trace(of, into); }, rays, of_cut);
    opaque_s += tracing_s([&](auto of, auto& into) { opaque.trace(of, into); }, rays, of_opaque);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (of_cut[i].range_m < of_opaque[i].range_m - 1e-6)
      return state.SkipWithError("a leaf that is cut out hides what the whole leaf does not");
  }
  state.counters["of_opaque"] = cut_s / opaque_s;
}
BENCHMARK(objects_alpha)->MinTime(2);

}  // namespace
}  // namespace groundray::benchmark
