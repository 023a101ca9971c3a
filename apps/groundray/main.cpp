#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <filesystem>
#include <new>

#include "apps/groundray/generate.h"
#include "apps/groundray/info.h"
#include "core/error.h"

namespace {

constexpr int done = 0;
constexpr int failed = 1;
constexpr int wrong_usage = 2;
constexpr int interrupted = 130;

int run(int argc, char** argv) {
  CLI::App app(
      "groundray makes lidar ground truth over real terrain: every point with its true place, "
      "range and normal.");
  app.footer(
      "A first run:  groundray generate data/scenes/first_light.yaml -o out/first_light\n"
      "Exit codes:   0 done, 1 failed, 2 wrong usage, 130 interrupted (the same command goes on)\n"
      "Data:         presets are looked up in $GROUNDRAY_DATA/sensors, else beside the program");
  app.set_version_flag("--version", "groundray " GROUNDRAY_VERSION);
  app.require_subcommand(1);

  std::filesystem::path scene;
  std::filesystem::path out;
  auto* generate = app.add_subcommand(
      "generate", "Run a scene and write its dataset: scans, poses, calibration, pictures");
  generate->add_option("SCENE", scene, "Scene file (YAML, see docs/scene.md)")->required();
  generate
      ->add_option(
          "-o,--output", out,
          "Folder for the dataset; made if missing; a run that was interrupted goes on in it")
      ->required();

  std::filesystem::path file;
  auto* info = app.add_subcommand("info", "Say what a file is and what it would take");
  info->add_option(
          "FILE", file,
          "A DEM (GeoTIFF, HGT, ASCII grid, ...): size, CRS, cell, heights, holes, memory; "
          "or a scene (.yaml): what it would make")
      ->required();

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? done : wrong_usage;
  }
  if (info->parsed()) {
    groundray::print_info(file);
    return done;
  }
  return groundray::generate(scene, out) == groundray::RunEnd::Done ? done : interrupted;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ,
              SIG_IGN);  // a limit on file size is then an error of the write, with a message
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr,
               "groundray: there is not enough memory; `groundray info` tells how much a DEM or "
               "scene needs\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "groundray: {}\n", error.what());
  }
  return failed;
}
