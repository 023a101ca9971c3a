#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <csignal>
#include <exception>
#include <filesystem>
#include <new>
#include <utility>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/describe/named_facts.h"
#include "apps/groundray/info.h"
#include "apps/groundray/run_controls.h"
#include "apps/scan/command_text.h"
#include "apps/scan/usage_fault.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/print_error.h"

namespace {

constexpr int done = 0;
constexpr int failed = 1;
constexpr int interrupted = 130;

// Commands by task, for help.
constexpr std::array<std::pair<const char*, const char*>, 10> tasks{
    {{"generate", "Simulate sensors"},
     {"sample", "Simulate sensors"},
     {"voxels", "Simulate sensors"},
     {"verify", "Simulate sensors"},
     {"merge", "Simulate sensors"},
     {"info", "Look at files and data"},
     {"list", "Look at files and data"},
     {"terrain", "Work on terrain and measurements"},
     {"traversability", "Work on terrain and measurements"},
     {"reconstruct", "Work on terrain and measurements"}}};

int run(int argc, char** argv) {
  CLI::App app(
      "groundray is a simulator of lidars and cameras on rough terrain: it makes synthetic data "
      "with ground truth, the true position, range and normal of every point and pixel.",
      "groundray");
  app.footer(
      "A first run:         groundray generate data/scenes/first_light.yaml -o out/first_light\n"
      "Its result:          groundray info out/first_light\n"
      "Exit codes:          0 done, 1 failed, 2 wrong usage, 130 interrupted (--resume continues)\n"
      "Data:                presets are in $GROUNDRAY_DATA/sensors, else beside the program");
  app.set_version_flag("--version", "groundray " GROUNDRAY_VERSION);
  app.require_subcommand(1);

  std::vector<groundray::Command> commands;
  groundray::add_run_commands(app, commands);
  commands.push_back(groundray::add_sample_command(app));
  commands.push_back(groundray::add_voxels_command(app));

  std::filesystem::path file;
  auto* info = app.add_subcommand("info", "Describe a file, a dataset or a preset");
  info->add_option("FILE", file,
                   "A DEM: size, CRS, cell, heights, holes, memory; a scene (.yaml): its expected "
                   "output; a dataset: its contents; a lidar, camera or material (.yaml, or a name "
                   "of `groundray list`); a mesh; a cloud or scan; an image")
      ->required()
      ->type_name(groundray::file_or_name);

  commands.push_back({info, [&] { groundray::print_info(file); }});
  commands.push_back(groundray::add_list_command(app));
  groundray::add_terrain_commands(app, commands);
  commands.push_back(groundray::add_traversability_command(app));
  groundray::add_reconstruct_commands(app, commands);

  for (const auto& [name, task] : tasks) app.get_subcommand(name)->group(task);
  groundray::RunControls controls;
  for (const groundray::Command& command : commands) controls.add(command.app);

  if (const auto code = groundray::parse_arguments(app, argc, argv, groundray::names_of_data))
    return *code;
  const groundray::AppliedControls applied(controls);
  for (const groundray::Command& command : commands)
    if (command.app->parsed()) command.run();
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ,
              SIG_IGN);  // a write beyond the limit of file size then fails with a message
  groundray::catch_interruptions();
  try {
    const int code = run(argc, argv);
    if (groundray::flush_output()) return code;
    groundray::print_error("groundray: standard output cannot be written\n");
  } catch (const groundray::Interrupted&) {
    groundray::print_error(
        "\ngroundray: interrupted; a run or a merge continues with --resume, other commands "
        "start again\n");
    return interrupted;
  } catch (const std::bad_alloc&) {
    groundray::print_error(
        "groundray: there is not enough memory; `groundray info` reports how much a DEM or "
        "scene needs\n");
  } catch (const std::exception& error) {
    groundray::print_error("groundray: {}\n", error.what());
  }
  return failed;
}
