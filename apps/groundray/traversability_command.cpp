#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/progress_stage.h"
#include "apps/groundray/whole_folder.h"
#include "apps/scan/number_checks.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/scene_place.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "terrain/dem/layers_io.h"
#include "terrain/terrain.h"
#include "terrain/traversability/traversability.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

std::string bound_text(const std::optional<double>& bound) {
  return bound ? fmt::format("{}", *bound) : "null";
}

// Options of the command.
struct TraversabilityOptions {
  fs::path input, out;
  DemOptions reading;
  std::optional<std::uint32_t> world;
  TraversabilitySpec spec;
  std::size_t most_bytes = machine_bytes();

  void add_input(CLI::App* command) {
    command
        ->add_option("SCENE_OR_DEM", input,
                     "Scene file (.yaml), for its ground with erosion, relief and trails; or a "
                     "raster of heights")
        ->required();
    command->add_option("-o,--output", out, "New or empty folder for the layers")->required();
    add_number(command, "--cell-m", spec.cell_m, positive(), "Distance of samples of the layers")
        ->required();
    command->add_option("--world", world, "One of the worlds of the scene, from 0")->check(whole());
    command->add_option("--nodata", reading.nodata,
                        "Additional nodata value of a DEM, besides the one that the file declares");
    command->add_option(
        "--reproject-to", reading.reproject_to,
        "A CRS to warp a DEM to, such as EPSG:32631, or utm for the zone that fits");
    add_memory(command, most_bytes, "Limit of memory for the layers (what the machine has)");
  }

  void add_vehicle(CLI::App* command) {
    auto* group = command->add_option_group("Vehicle");
    VehicleSize& vehicle = spec.vehicle;
    const auto add = [&](const char* name, double& held, const char* meaning) {
      add_number(group, name, held, positive(), meaning)->required();
    };
    add("--length-m", vehicle.length_m, "Length of the flat underbody");
    add("--width-m", vehicle.width_m, "Width of the underbody");
    add("--wheelbase-m", vehicle.wheelbase_m, "Distance of the axles");
    add("--track-m", vehicle.track_m, "Distance of the wheels of an axle");
    add("--clearance-m", vehicle.clearance_m, "Height of the underbody above level ground");
    add("--wheel-radius-m", vehicle.wheel_radius_m, "Radius of a wheel");
    group->add_option("--headings", spec.headings, "Headings of the vehicle over half a turn (8)")
        ->check(CLI::Range(1, 360));
    add_number(group, "--plane-radius-m", spec.plane_radius_m, positive(),
               "Radius of the disc for slope and roughness (half the diagonal of the vehicle)");
    add_number(group, "--step-radius-m", spec.step_radius_m, positive(),
               "Radius of the disc for steps (that of a wheel)");
  }

  void add_limits(CLI::App* command) {
    auto* group = command->add_option_group("Limits");
    TraversabilityLimits& limits = spec.limits;
    add_number(group, "--max-slope-deg", limits.slope_deg, not_negative(),
               "Steepest slope that is traversable (any)");
    add_number(group, "--max-roughness-m", limits.roughness_m, not_negative(),
               "Largest traversable roughness (any)");
    add_number(group, "--max-step-m", limits.step_m, not_negative(),
               "Highest traversable step (any)");
    group->add_option("--min-clearance-m", limits.least_clearance_m,
                      "Ground this close to the underbody, or closer, is not traversable (0)");
  }

  bool is_scene() const {
    const std::string ending = file_ending(input);
    return ending == ".yaml" || ending == ".yml";
  }

  Terrain load() const {
    Certifying certifying;
    const auto progress = [&](double share) { certifying.update(share); };
    if (!is_scene()) {
      if (world) throw Error("{}: --world applies only to scenes (.yaml); omit it", input.string());
      return {input, reading, {}, progress};
    }
    if (reading.nodata || !reading.reproject_to.empty()) {
      throw Error(
          "{}: --nodata and --reproject-to apply only to DEMs; state them in the scene's "
          "'terrain' instead",
          input.string());
    }
    const SceneSpec scene = load_scene(input, data_folder() / "sensors", world);
    return located(scene.terrain.where, "key 'dem'", [&] {
      return Terrain(scene.terrain.dem, scene.terrain.options, scene.terrain.detail, progress,
                     scene.terrain.relief, scene.terrain.erosion);
    });
  }

  // Returns the parameters and the counts, as YAML.
  std::string record(const VerdictCounts& counts) const {
    const VehicleSize& vehicle = spec.vehicle;
    const TraversabilityLimits& limits = spec.limits;
    std::string text = fmt::format(
        "groundray_traversability: 1\nversion: \"{}\"\ncell_m: {}\nvehicle: {{length_m: {}, "
        "width_m: {}, wheelbase_m: {}, track_m: {}, clearance_m: {}, wheel_radius_m: {}}}\n",
        GROUNDRAY_VERSION, spec.cell_m, vehicle.length_m, vehicle.width_m, vehicle.wheelbase_m,
        vehicle.track_m, vehicle.clearance_m, vehicle.wheel_radius_m);
    text += fmt::format("headings: {}\nplane_radius_m: {}\nstep_radius_m: {}\n", spec.headings,
                        spec.plane_radius_m.value_or(vehicle.half_diagonal_m()),
                        spec.step_radius_m.value_or(vehicle.wheel_radius_m));
    text += fmt::format(
        "limits: {{max_slope_deg: {}, max_roughness_m: {}, max_step_m: {}, min_clearance_m: {}}}\n",
        bound_text(limits.slope_deg), bound_text(limits.roughness_m), bound_text(limits.step_m),
        limits.least_clearance_m);
    text += fmt::format("samples: {}\ntraversable: {}\nobstacles: {{", counts.known,
                        counts.traversable);
    for (std::size_t i = 0; i < names.size(); ++i)
      text += fmt::format("{}{}: {}", i > 0 ? ", " : "", names[i], counts.obstacles[i]);
    return text + "}\n";
  }

  static void write(const Terrain& terrain, const TraversabilityLayers& layers,
                    const WholeFolder& folder) {
    const DemHeader& header = terrain.header();
    const Georeference place{.origin_w_m = header.origin_w_m, .crs_wkt = header.crs_wkt};
    const auto write_floats = [&](const char* file, const RasterLayer& layer) {
      stop_if_interrupted();
      write_layers(folder.file(file), layers.frame, place, {&layer, 1}, {.is_point = true});
    };
    write_floats("elevation.tif", {"elevation", "m", layers.elevation_m});
    write_floats("slope.tif", {"slope", "deg", layers.slope_deg});
    write_floats("roughness.tif", {"roughness", "m", layers.roughness_m});
    write_floats("step.tif", {"step", "m", layers.step_m});
    write_floats("clearance.tif", {"clearance", "m", layers.clearance_m});
    write_byte_layer(folder.file("belly_contact.tif"), layers.frame, place, "belly_contact",
                     layers.belly_contact, no_verdict);
    write_byte_layer(folder.file("verdict.tif"), layers.frame, place, "verdict", layers.verdict,
                     no_verdict);
  }

  void run() const {
    WholeFolder folder(out);
    const Terrain terrain = load();
    StageProgress progress;
    const TraversabilityLayers layers =
        traversability(terrain.ground(), spec, most_bytes,
                       [&](double share) { progress.update("traversability", share); });
    const VerdictCounts counts = count_verdicts(layers);
    write(terrain, layers, folder);
    write_text(folder.file("traversability.yaml"), record(counts));
    const auto percent = [&](std::size_t count) {
      return 100 * static_cast<double>(count) / static_cast<double>(counts.known);
    };
    print_text(stdout, "{} of {} samples have ground under the whole vehicle\n", counts.known,
               layers.verdict.size());
    print_text(stdout, "{:>8.3f} % traversable\n", percent(counts.traversable));
    for (std::size_t i = 0; i < names.size(); ++i)
      print_text(stdout, "{:>8.3f} % not, by {}\n", percent(counts.obstacles[i]), names[i]);
    folder.appear();
  }

 private:
  // Of obstacles, in the order of GroundObstacle.
  static constexpr std::array<const char*, 4> names{"slope", "roughness", "step", "clearance"};
};

}  // namespace

Command add_traversability_command(CLI::App& app) {
  const auto options = std::make_shared<TraversabilityOptions>();
  CLI::App* command = app.add_subcommand(
      "traversability",
      "Write slope, roughness, steps and clearance of ground for a vehicle, and its verdict");
  options->add_input(command);
  options->add_vehicle(command);
  options->add_limits(command);
  return {command, [options] { options->run(); }};
}

}  // namespace groundray
