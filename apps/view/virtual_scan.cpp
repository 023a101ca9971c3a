#include "apps/view/virtual_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "apps/scene/interruption.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/view/layers/dem_layer.h"
#include "core/appearance/material.h"
#include "core/error.h"
#include "sensors/sky/sun.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

// Margin of the trajectory around the sweep, because rounding may place firings slightly outside
// it.
constexpr std::chrono::seconds margin(1);
// Minimum fraction of a sweep between two progress reports.
constexpr double least_step = 0.01;

// Lambertian grey from 200 nm to 20 µm.
Material bare_ground() {
  return {.name = "bare ground",
          .reflection = Lambertian{{{200, bare_reflectance}, {20'000, bare_reflectance}}}};
}

// Applies the scene's settings for its lidars: see docs/reference/scene.md.
void apply_scene_settings(const SceneSpec& scene, const Materials& materials, LidarSpec& lidar,
                          std::vector<std::string>& notes) {
  if (!lidar.light) return;
  if (materials.all().empty()) {
    lidar.light.reset();
    lidar.beam.sub_rays = 1;
    lidar.beam.most_sub_rays.reset();
    lidar.waveforms = LidarSpec::WaveformOutput::Omit;
    notes.emplace_back(
        "the scene's surfaces have no materials, so only rays were traced: ranges are exact, "
        "without noise of light. Give the terrain a material to simulate the laser's echoes");
    return;
  }
  if (scene.text.empty()) {  // made by simulation_of_dem()
    notes.push_back(
        fmt::format("a DEM has no materials, so grey ground was assumed: a Lambertian reflectance "
                    "of {:.0f} % at all wavelengths",
                    100 * bare_reflectance));
  }
  const AtmosphereSpec& air = scene.air;
  if ((air.backscatter_per_m_sr > 0 || std::isfinite(air.fog_range_m)) &&
      lidar.light->overlap.full_from_m == 0) {
    throw Error(
        "{}: the receiver needs overlap_m: [from, to], the ranges over which the beam enters its "
        "view: fog scatters light back from all ranges",
        lidar.model);
  }
  SolarBackground& background = lidar.light->sun;
  if (background.irradiance_w_m2_nm || !scene.sky || !scene.sky->sun) return;
  const Sun sun = sun_of(*scene.sky).value();
  background.irradiance_w_m2_nm = solar_irradiance_w_m2_nm(sun, lidar.light->wavelength_nm);
  background.direction = sun.direction();
}

}  // namespace

std::vector<SensorPreset> lidar_presets() {
  const std::filesystem::path folder = data_folder() / "sensors";
  std::vector<SensorPreset> presets;
  for (const std::string& name : preset_names(folder, SensorKind::Lidar)) {
    LidarSpec lidar = load_lidar(folder / (name + ".yaml"));
    std::string model = lidar.model.empty() ? name : lidar.model;
    presets.push_back({name, std::move(model), std::move(lidar)});
  }
  return presets;
}

Simulation simulation_of_dem(const std::filesystem::path& dem, const std::stop_token& stop) {
  SceneSpec spec;
  spec.terrain = {.dem = dem, .options = options_for(dem), .material = bare_ground()};
  Terrain terrain(dem, spec.terrain.options, spec.terrain.detail, [&](double) {
    if (stop.stop_requested()) throw Interrupted{};
  });
  SceneObjects objects;
  objects.materials = Materials({bare_ground()});
  return {
      .spec = std::move(spec), .terrain = std::move(terrain), .scene_objects = std::move(objects)};
}

Pose pose_at(const SensorPlace& place, const Ground& ground) {
  if (!(place.height_m > 0) || !std::isfinite(place.height_m))
    throw Error("a sensor {} m above the ground cannot see it: the height must be > 0",
                place.height_m);
  const auto ground_m = ground.height_m_at(place.at_m);
  const auto facet = ground.facet_at(place.at_m);
  if (!ground_m || !facet) {
    throw Error("there is no ground at ({:.3f}, {:.3f}) m in D: put the sensor inside the DEM",
                place.at_m.x, place.at_m.y);
  }
  Pose X_DS{rotation_from_yaw_pitch_roll(place.heading_rad, 0, 0),
            {place.at_m, *ground_m + place.height_m}};
  if (place.stance == Stance::OnSlope)
    X_DS.rotation = tilt_to(ground.frame().normal(*facet)) * X_DS.rotation;
  return X_DS;
}

PlacedScan SceneScanner::scan(LidarSpec spec, const Pose& X_DS, const std::stop_token& stop,
                              const ScanProgress& progress) {
  const auto report = [&](double share, const std::string& step) {
    if (progress) progress(share, step);
    if (stop.stop_requested()) throw Interrupted{};
  };
  report(0, "preparing the sensor");
  PlacedScan placed;
  apply_scene_settings(simulation_.spec, simulation_.scene_objects.materials, spec, placed.notes);
  const Lidar lidar(spec, simulation_.spec.air);
  constexpr std::int64_t sweep = 0;
  placed.stamp = lidar.pattern().stamp(sweep);
  const nanoseconds end = lidar.pattern().last_firing(sweep);
  const Trajectory at_rest({{placed.stamp - margin, X_DS}, {end + margin, X_DS}});
  report(0.05, "building the terrain round the sensor");
  const Scene& scene = scene_({&at_rest, placed.stamp, end});
  const std::string step = fmt::format("scanning, {} pulses", lidar.pattern().pulses(sweep));
  double reported = 0;
  const auto watch = [&](double share) {
    if (progress && share - reported >= least_step) progress(0.3 + 0.7 * (reported = share), step);
    return !stop.stop_requested();
  };
  report(0.3, step);
  try {
    placed.scan = lidar.scan(scene, at_rest, sweep, simulation_.spec.seed, 0, watch);
  } catch (const SweepStopped&) {
    throw Interrupted{};
  }
  report(1, "done");
  return placed;
}

}  // namespace groundray
