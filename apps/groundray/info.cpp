#include "apps/groundray/info.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <glm/trigonometric.hpp>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/dataset_text.h"
#include "apps/dataset/write/journal.h"
#include "apps/groundray/describe/file_facts.h"
#include "apps/groundray/describe/named_facts.h"
#include "apps/groundray/describe/sensor_facts.h"
#include "apps/groundray/estimate.h"
#include "apps/scene/notes.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "core/math.h"
#include "core/near_names.h"
#include "core/progress.h"
#include "terrain/dem/dem_file.h"
#include "terrain/dem/dem_io.h"
#include "terrain/lod/certificate.h"
#include "terrain/terrain_scene.h"

namespace groundray {
namespace {

constexpr double mib = 1 << 20;

void print_frame(const GridFrame& frame, const glm::dvec3& origin_w_m) {
  const glm::dvec2 step_m = glm::abs(frame.step_m);
  const glm::dvec2 cells(frame.samples - 1);
  const glm::dvec2 centre_m = glm::dvec2(origin_w_m) + frame.origin_m + cells * frame.step_m / 2.0;
  print_text(stdout, "centre    {:.3f}, {:.3f} m\n", centre_m.x, centre_m.y);
  print_text(stdout, "extent    {:.1f} x {:.1f} m\n", step_m.x * cells.x, step_m.y * cells.y);
  print_text(stdout, "cell      {:.6g} x {:.6g} m\n", step_m.x, step_m.y);
}

void print_heights(const HeightGrid& grid) {
  const double samples = static_cast<double>(grid.heights_m().size());
  print_text(stdout, "heights   {:.3f} to {:.3f} m\n", grid.min_height_m(), grid.max_height_m());
  print_text(stdout, "holes     {} samples ({:.2f} %)\n", grid.hole_count(),
             100 * static_cast<double>(grid.hole_count()) / samples);
}

void print_certificate(const DemFile& dem) {
  const std::optional<Certificate> certificate = Certificate::open(dem);
  if (!certificate) {
    print_text(stdout, "certified no; use `groundray terrain certify`\n");
    return;
  }
  const LevelSummary& root = certificate->levels().back();
  print_text(stdout, "certified yes, in {}: ", certificate->folder().string());
  if (root.mixed > 0) {
    print_text(stdout, "it has holes; {} of {} blocks of 8 x 8 cells touch one\n",
               certificate->levels().front().mixed, certificate->levels().front().nodes);
  } else {
    print_text(stdout, "a single cell deviates by at most {:.6g} m\n", root.max_deviation_m);
  }
}

// Prints the header first: there may be nothing else to print for a DEM that cannot be traced.
void print_dem(const std::filesystem::path& path) {
  const DemInfo info = inspect_dem(path);
  print_text(stdout, "format    {}, {}\nsize      {} x {} samples\nCRS       {}\n", info.driver,
             info.sample_type, info.columns, info.rows, info.crs_name);
  std::fflush(stdout);
  const DemFile dem(path);
  const DemHeader& header = dem.header();
  print_frame({header.samples, header.origin_m, header.step_m, 1.0 / header.step_m},
              header.origin_w_m);
  const double traced_mib = Terrain::whole_bytes(header.samples) / mib;
  if (traced_mib < TerrainDetail{}.memory_mib) print_heights(load_dem(path).grid);
  print_text(stdout, "memory    about {:.0f} MiB to trace as a whole\n", traced_mib);
  print_certificate(dem);
}

// Prints the terrain's levels round the sensors of the first frame.
void print_levels(const Simulation& simulation) {
  const Terrain& terrain = simulation.terrain;
  const Exposed first = first_frame(simulation);
  const SensorBox sensors = sensor_box(first);
  const glm::dvec3 p_DL = float_frame_origin(first.X_DS->pose_at(first.begin).translation_m);
  const RayTracer rays = terrain.whole() != nullptr
                             ? RayTracer({terrain.whole_level()}, p_DL, simulation.spec.tracing)
                             : build_tracer(terrain.clipmap(sensors, simulation.reach_m), p_DL,
                                            simulation.spec.tracing);
  std::size_t triangles = 0;
  double bytes = static_cast<double>(rays.device().memory_bytes());
  print_text(stdout,
             "levels    round the first frame; deviation is the certified bound, in height\n");
  print_text(stdout, "  {:>10} {:>21} {:>12} {:>12} {:>9}\n", "cell m", "window m", "triangles",
             "deviation m", "bridging");
  for (const LevelScene& scene : rays.levels()) {
    const Level& level = scene.level();
    const glm::dvec2 cell_m = glm::abs(terrain.frame().step_m) * static_cast<double>(level.step);
    const glm::dvec2 window_m = glm::dvec2(level.heights.size() - 1) * cell_m;
    print_text(stdout, "  {:>10.6g} {:>10.0f} x {:>8.0f} {:>12} {:>12.4g} {:>9}\n", cell_m.x,
               window_m.x, window_m.y, scene.triangle_count(), scene.deviation_m(),
               scene.bridging_leaves());
    triangles += scene.triangle_count();
    bytes += 4.0 * static_cast<double>(level.heights.heights_m().size());
  }
  print_text(stdout, "triangles {} in {:.0f} MiB\n", triangles, bytes / mib);
}

// The lowest layer is the terrain itself.
void print_cover(const TerrainSpec& terrain, const GroundCover& cover) {
  for (std::size_t i = 0; i < cover.layers().size(); ++i) {
    const CoverLayer& layer = cover.layers()[i];
    const CoverSpec* const spec = i == 0 ? nullptr : &terrain.cover[i - 1];
    const auto& material = spec == nullptr ? terrain.material : spec->material;
    const SiteConditions site = spec == nullptr ? SiteConditions{} : spec->site;
    const bool has_file = spec != nullptr && !spec->mask.empty();
    print_text(stdout, "cover     {} of label {}{}{}{}{}{}\n",
               material ? material->name : "no material", layer.label,
               layer.texture ? fmt::format(", with images of {} m", layer.texture->size_m) : "",
               layer.lines.empty() ? "" : ", by the distance from trails",
               site.water ? ", by water" : "", site.canopy ? ", by the canopy" : "",
               has_file ? ", by a mask" : "");
  }
}

// Prints the materials if cameras or lidars with light use them.
void print_materials(const Simulation& simulation) {
  const auto has_light = [](const PlacedLidar& lidar) {
    return lidar.spec.lidar.light.has_value();
  };
  if (simulation.cameras.empty() && std::ranges::none_of(simulation.lidars, has_light)) return;
  std::vector<std::string_view> names;
  for (const Material& material : simulation.scene_objects.materials.all())
    names.push_back(material.name);
  print_text(stdout, "materials {}\n", fmt::join(names, ", "));
}

void print_content(const SceneObjects& content) {
  for (const SceneObjects::Group& group : content.groups) {
    print_text(stdout, "objects   {}: {} of label {}, instances from {}\n", group.name, group.count,
               group.label, group.first);
  }
  if (!content.shapes.empty()) {
    std::size_t triangles = 0, instances = 0;
    for (const SceneObjects::Group& group : content.groups) instances += group.count;
    for (const ModelScene& shape : content.shapes) triangles += shape.model().mesh.triangles.size();
    print_text(stdout, "models    {} of {} triangles for {} objects\n", content.shapes.size(),
               triangles, instances);
  }
  if (content.memory_bytes > 0) {
    print_text(stdout, "memory    {:.1f} MiB of objects, textures and cover\n",
               static_cast<double>(content.memory_bytes) / mib);
  }
}

std::string words_for(const ConstantSky& sky, const ClearAir& /*air*/) {
  return fmt::format("constant: ({}, {}, {}) W/(m2 sr)", sky.radiance.x, sky.radiance.y,
                     sky.radiance.z);
}
std::string words_for(const EnvironmentImage& sky, const ClearAir& /*air*/) {
  return sky.image.string();
}
std::string words_for(const AnalyticSky& sky, const ClearAir& air) {
  const std::string clouds =
      sky.clouds ? fmt::format("clouds over {:g} %", 100 * sky.clouds->cover) : "clear";
  return fmt::format("{}, turbidity {}", clouds, air.turbidity);
}

double azimuth_deg(const glm::dvec2& towards) {
  const double azimuth = glm::degrees(math::atan2(towards.x, towards.y));
  return azimuth < 0 ? azimuth + 360 : azimuth;
}

void print_wind(const Wind& wind) {
  print_text(stdout, "wind      {:g} m/s from {:.4g} degrees in W, turbulence {:g}\n",
             wind.speed_m_s, azimuth_deg(-wind.towards), wind.turbulence);
}

void print_sky(const SkySpec& spec) {
  print_text(stdout, "sky       {}\n",
             std::visit([&](const auto& dome) { return words_for(dome, spec.air); }, spec.dome));
  if (!spec.sun) return;
  const Sun sun = sun_of(spec).value();
  print_text(stdout, "sun       elevation {:.2f}, azimuth {:.2f} degrees in W{}\n",
             glm::degrees(sun.elevation_rad()), azimuth_deg(glm::dvec2(sun.direction())),
             sun.transmittance() < 1
                 ? fmt::format("; clouds let {:.2g} % of its light pass", 100 * sun.transmittance())
                 : "");
}

void print_lidar(const PlacedLidar& lidar) {
  const ScanPattern& pattern = lidar.lidar.pattern();
  const auto& light = lidar.spec.lidar.light;
  const double pulses = static_cast<double>(pattern.pulses(0)) * static_cast<double>(lidar.sweeps);
  print_text(stdout, "lidar     {}: {}, {} scans of about {:.0f} pulses\n", lidar.spec.name,
             lidar.spec.lidar.model, lidar.sweeps, pulses / static_cast<double>(lidar.sweeps));
  if (!light || !light->sun.irradiance_w_m2_nm) return;
  print_text(stdout, "          sunlight {:.4g} W/(m2 nm) at {} nm, {}\n",
             *light->sun.irradiance_w_m2_nm, light->wavelength_nm,
             light->sun.direction ? "across its rays" : "on all surfaces alike");
}

void print_camera(const PlacedCamera& placed) {
  const CameraSpec& camera = placed.spec.camera;
  const double pixels = static_cast<double>(camera.size_px.x) * camera.size_px.y;
  print_text(stdout, "camera    {}: {}, {} images of {} x {} px in {:.4g} ms\n", placed.spec.name,
             camera.model, placed.begins.size(), camera.size_px.x, camera.size_px.y,
             1e-6 * static_cast<double>(placed.camera.duration().count()));
  if (camera.shutter.automatic) print_text(stdout, "          {}\n", exposure_text(camera.shutter));
  if (needs_light(camera)) {
    print_text(
        stdout,
        "          {} to {} paths a pixel of up to {} rays: {:.3g} M paths an image or more\n",
        camera.sampling.samples, camera.sampling.most_samples, camera.sampling.depth,
        1e-6 * pixels * camera.sampling.samples);
  }
}

// Prints the time and the bytes of a run, and of one frame of each sensor.
void print_estimate(const Simulation& simulation, const RunEstimate& estimate) {
  const auto each = [](const char* kind, const std::string& name, std::size_t frames,
                       const RunEstimate::Frame& frame) {
    print_text(stdout, "          {}: {} {} of {} and {:.3g} MiB\n", name, frames, kind,
               duration_text(frame.time), static_cast<double>(frame.bytes) / mib);
  };
  print_text(stdout, "time      about {} on this machine, with {} of preparation\n",
             duration_text(estimate.total), duration_text(estimate.preparation));
  print_text(stdout, "output    about {:.3g} MiB\n",
             static_cast<double>(estimate.total_bytes) / mib);
  for (std::size_t i = 0; i < estimate.scans.size(); ++i) {
    const PlacedLidar& lidar = simulation.lidars[i];
    each("scans", lidar.spec.name, static_cast<std::size_t>(lidar.sweeps), estimate.scans[i]);
  }
  for (std::size_t i = 0; i < estimate.images.size(); ++i) {
    const PlacedCamera& camera = simulation.cameras[i];
    each("images", camera.spec.name, camera.begins.size(), estimate.images[i]);
  }
}

void print_scene(const Simulation& simulation) {
  print_text(stdout, "seed      {}\n", simulation.spec.seed.value);
  if (const auto& world = simulation.spec.world)
    print_text(stdout, "world     {}: {}\n", world->number, world->drawn);
  print_text(stdout, "duration  {} s, {} tracing\n", simulation.spec.duration_s,
             simulation.spec.tracing == Tracing::Fast ? "fast" : "exact");
  print_text(stdout, "terrain   {}\n", simulation.spec.terrain.dem.string());
  print_text(stdout, "CRS       {}\n", simulation.terrain.header().crs_name);
  print_frame(simulation.terrain.frame(), simulation.terrain.header().origin_w_m);
  if (simulation.terrain.whole() != nullptr) print_heights(*simulation.terrain.whole());
  print_levels(simulation);
  print_cover(simulation.spec.terrain, simulation.scene_objects.cover);
  print_content(simulation.scene_objects);
  print_materials(simulation);
  if (simulation.spec.sky) print_sky(*simulation.spec.sky);
  if (simulation.spec.wind.speed_m_s > 0) print_wind(simulation.spec.wind);
  for (const PlacedLidar& lidar : simulation.lidars) print_lidar(lidar);
  for (const PlacedCamera& camera : simulation.cameras) print_camera(camera);
  for (const std::string& note : notes_of(simulation)) print_text(stdout, "note      {}\n", note);
  std::fflush(stdout);  // the measurement may take a while
  print_estimate(simulation, estimate_run(simulation));
}

void print_dataset(const std::filesystem::path& folder) {
  DatasetSummary dataset = read_summary(folder);
  const bool is_open = std::filesystem::exists(folder / journal_file);
  if (is_open) count_journal(folder / journal_file, dataset);
  print_text(stdout, "dataset   {} of {} frames are complete{}\n", dataset.done, dataset.asked_for,
             is_open ? "; a run is in progress, or was interrupted and continues with --resume"
             : dataset.done < dataset.asked_for
                 ? "; --resume of `groundray generate`, or of `groundray merge` if that was "
                   "interrupted, adds the rest"
                 : "");
  if (dataset.part.shard) print_text(stdout, "shard     {}\n", text_of(*dataset.part.shard));
  if (const std::string chosen = text_of(dataset.part.choice); !chosen.empty())
    print_text(stdout, "chosen    {}\n", chosen);
  print_text(stdout, "version   {}\nseed      {}\n", dataset.version, dataset.seed);
  for (const DatasetSummary::Sensor& sensor : dataset.sensors) {
    print_text(stdout, "{:<9} {}: {}, {} of {} frames, {:.1f} MiB\n", sensor.kind, sensor.name,
               sensor.model, sensor.done, sensor.asked_for,
               static_cast<double>(sensor.bytes) / mib);
  }
}

// PNGs of 16 bits are DEMs, too, if a world file places them.
bool is_dem(const std::filesystem::path& file) {
  try {
    const DemFile dem(file);
    return true;
  } catch (const Error&) {
    return false;
  }
}

void print_named(const std::string& name) {
  const std::vector<Facts> all = named_facts(name);
  if (all.empty()) {
    throw Error(
        "{}: there is no such file, preset, material or asset{}; `groundray list` lists the names",
        name, suggestion(name, names_of_data()));
  }
  for (const Facts& facts : all) {
    if (&facts != all.data()) print_text(stdout, "\n");
    print_facts(facts);
  }
}

}  // namespace

void print_info(const std::filesystem::path& file) {
  if (std::filesystem::exists(file / dataset_file)) return print_dataset(file);
  const std::string ending = file_ending(file);
  if (ending == ".yaml" || ending == ".yml") {
    if (const auto facts = yaml_facts(file)) return print_facts(*facts);
    return print_scene(load_simulation(file));
  }
  const bool exists = std::filesystem::exists(file);
  if (!exists && !file.has_extension() && !file.has_parent_path())
    return print_named(file.string());
  if (const auto kind = file_kind_of(file); kind && exists) {
    print_facts(facts_of(file, *kind));
    if (ending != ".png" || !is_dem(file)) return;
    print_text(stdout, "\n");
  }
  try {
    print_dem(file);
  } catch (const Error&) {
    if (!std::filesystem::is_directory(file)) throw;
    throw Error("{}: it is neither the folder of a dataset nor a raster", file.string());
  }
}

}  // namespace groundray
