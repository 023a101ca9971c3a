#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <filesystem>
#include <new>

#include "apps/groundray/dem/fill_command.h"
#include "apps/groundray/info.h"
#include "apps/groundray/reconstruct_commands.h"
#include "apps/groundray/run_commands.h"
#include "apps/groundray/terrain_commands.h"
#include "apps/scene/interruption.h"
#include "core/error.h"

namespace {

constexpr int done = 0;
constexpr int failed = 1;
constexpr int wrong_usage = 2;
constexpr int interrupted = 130;

int run(int argc, char** argv) {
  CLI::App app(
      "groundray simulates lidars and cameras over real terrain with ground truth: the true "
      "position, range and normal of every point and pixel.");
  app.footer(
      "A first run:  groundray generate data/scenes/first_light.yaml -o out/first_light\nExit "
      "codes:   0 done, 1 failed, 2 wrong usage, 130 interrupted (--resume continues)\nData:       "
      "  presets are looked up in $GROUNDRAY_DATA/sensors, else beside the program");
  app.set_version_flag("--version", "groundray " GROUNDRAY_VERSION);
  app.require_subcommand(1);

  const groundray::RunCommands runs(app);

  std::filesystem::path out;
  std::filesystem::path file;
  auto* info = app.add_subcommand("info", "Describe a file and the resources that it needs");
  info->add_option("FILE", file,
                   "A DEM (GeoTIFF, HGT, ASCII grid, ...): size, CRS, cell, heights, holes, "
                   "memory; a scene (.yaml): its expected output; or a dataset: its contents")
      ->required();

  auto* terrain = app.add_subcommand("terrain", "Work on a DEM");
  terrain->require_subcommand(1);
  groundray::DemOptions dem_options;
  const auto add_dem = [&](CLI::App* command) {
    command
        ->add_option("DEM", file, "Any raster of heights that GDAL reads (GeoTIFF, VRT, HGT, ...)")
        ->required();
    command->add_option("--nodata", dem_options.nodata,
                        "Additional nodata value, besides the one that the file declares");
    command->add_option("--reproject-to", dem_options.reproject_to,
                        "A CRS to warp to, such as EPSG:32631, or utm for the zone that fits");
  };
  groundray::MeshRequest request;
  std::vector<double> viewpoint;
  double angle_mrad = 0;
  auto* mesh = terrain->add_subcommand(
      "mesh", "Write a DEM as a mesh without cracks, within an error bound");
  add_dem(mesh);
  mesh->add_option("-o,--output", out, "Mesh to write: .ply (doubles), .obj, .stl or .glb")
      ->required();
  mesh->add_option("--max-error-m", request.max_error_m,
                   "Largest vertical distance from the DEM's surface, anywhere")
      ->required()
      ->check(CLI::NonNegativeNumber);
  auto* angle =
      mesh->add_option(
              "--angle-mrad", angle_mrad,
              "Permitted angle in milliradians, seen from --viewpoint, where that is larger")
          ->check(CLI::NonNegativeNumber);
  auto* from = mesh->add_option("--viewpoint", viewpoint, "X,Y,Z in the DEM's CRS, metres")
                   ->delimiter(',')
                   ->expected(3)
                   ->needs(angle);
  angle->needs(from);
  auto* certify = terrain->add_subcommand(
      "certify",
      "Compute the deviation of each node of the DEM's quadtree, store it beside the DEM, and "
      "print a summary; `generate` uses it for DEMs larger than memory");
  add_dem(certify);

  const groundray::FillCommand fill(*terrain);
  const groundray::ReconstructCommands reconstruct(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? done : wrong_usage;
  }
  if (reconstruct.is_asked_for()) {
    reconstruct.run();
    return done;
  }
  if (fill.is_asked_for()) {
    fill.run();
    return done;
  }
  if (info->parsed()) {
    groundray::print_info(file);
    return done;
  }
  if (certify->parsed()) {
    groundray::certify_terrain(file, dem_options);
    return done;
  }
  if (mesh->parsed()) {
    if (!viewpoint.empty()) request.viewpoint = {viewpoint[0], viewpoint[1], viewpoint[2]};
    request.angle_rad = angle_mrad / 1000;
    groundray::mesh_terrain(file, dem_options, request, out);
    return done;
  }
  runs.run();
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ,
              SIG_IGN);  // a write beyond the limit of file size then fails with a message
  groundray::catch_interruptions();
  try {
    return run(argc, argv);
  } catch (const groundray::Interrupted&) {
    fmt::print(stderr,
               "\ngroundray: interrupted; a run or a merge continues with --resume, other commands "
               "start again\n");
    return interrupted;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr,
               "groundray: there is not enough memory; `groundray info` reports how much a DEM or "
               "scene needs\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "groundray: {}\n", error.what());
  }
  return failed;
}
