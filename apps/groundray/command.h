#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/scan_flags.h"

namespace groundray {

/// Subcommand of the program, and the function that executes it after its options are parsed.
struct Command {
  CLI::App* app = nullptr;
  std::function<void()> run;
};

/// Adds `generate`, `verify` and `merge` to the program, which make, check and join datasets.
void add_run_commands(CLI::App& app, std::vector<Command>& commands);
/// Adds `sample` to the program: worlds of a scene, whose values are drawn.
Command add_sample_command(CLI::App& app);
/// Adds `traversability` to the program: layers of the ground for a vehicle.
Command add_traversability_command(CLI::App& app);
/// Adds `voxels` to the program: occupied and visible voxels around lidars.
Command add_voxels_command(CLI::App& app);
/// Adds `list` to the program: the presets, materials and assets that a scene file can name.
Command add_list_command(CLI::App& app);
/// Adds `terrain` to the program: meshes, certificates and fills of DEMs.
void add_terrain_commands(CLI::App& app, std::vector<Command>& commands);
/// Adds `terrain fill`, which fills the blank areas of a DEM.
Command add_fill_command(CLI::App& terrain);
/// Adds `reconstruct` to the program: meshes and DEMs from measurements, operations on meshes.
void add_reconstruct_commands(CLI::App& app, std::vector<Command>& commands);
/// Adds `reconstruct dem`, which makes DEMs from scans and stereo pairs.
Command add_dem_command(CLI::App& reconstruct);

/// Adds an option for numbers that `check` accepts.
template <typename Held>
CLI::Option* add_number(CLI::App* app, const std::string& name, Held& held,
                        const CLI::Validator& check, const std::string& meaning) {
  return app->add_option(name, held, meaning)->check(check);
}

/// Adds an option whose values are in units of `unit`: `held` receives them in SI units.
template <typename Held>
CLI::Option* add_scaled(CLI::App* app, const std::string& name, Held& held, double unit,
                        const std::string& meaning) {
  return app->add_option_function<double>(
      name, [&held, unit](const double& value) { held = value * unit; }, meaning);
}

/// Returns the option of a command or of its groups that has a long name, with its dashes; null if
/// there is none. CLI11's own get_option allocates in functions that are noexcept, so that a lack
/// of memory would end the program without a message.
CLI::Option* option_of(CLI::App& command, std::string_view name);

/// Returns the machine's memory: the system may end a process that takes more, without a message.
std::size_t machine_bytes();

/// Adds the option of the memory limit.
template <typename Held>
void add_memory(CLI::App* command, Held& most_bytes, const std::string& meaning) {
  const auto set = [&most_bytes](const std::uint64_t& mb) {
    constexpr std::size_t bytes_per_mb = 1'000'000;
    constexpr std::size_t most_mb = std::numeric_limits<std::size_t>::max() / bytes_per_mb;
    most_bytes = std::min<std::size_t>(mb, most_mb) * bytes_per_mb;
  };
  command->add_option_function<std::uint64_t>("--memory-mb", set, meaning)->check(positive());
}

/// Names and values about a command, for its report.
using ReportFacts = std::vector<std::pair<std::string, std::string>>;

/// Returns version, name and inputs of a command.
ReportFacts facts_of(const std::string& command, std::span<const std::filesystem::path> inputs);

/// Options that select scans and control the reading of their files.
struct ScanOptions {
  ScanChoice choice;
  ScanTaking taking;
  ScanFlags columns;
  std::string frames = ":";
  bool leaves_labels = false;

  void add(CLI::App* command);
  /// Adds the option that defines neighbouring points, for commands that link them.
  void add_grid(CLI::App* command);
  /// Completes `choice` and `taking`; to be called after the command line has been parsed.
  /// @throws Error as parse_frames and ScanFlags.
  void close();

 private:
  void add_poses(CLI::App* scans);
};

}  // namespace groundray
