#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/python_module.h"
#include "apps/scene/interruption.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/sampling/world_sampler.h"
#include "apps/scene/simulation.h"
#include "apps/scene/yaml_writer.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "core/io/temporary_folder.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using sampling::WorldSampler;

struct SampleOptions {
  fs::path scene, out;
  std::optional<std::uint32_t> index, count;
  bool is_checked = false;
};

// Returns a field of a CSV file (RFC 4180).
std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

std::string csv_field(const yaml::Node& value) {
  const bool is_scalar =
      value.kind == yaml::Node::Kind::Plain || value.kind == yaml::Node::Kind::Quoted;
  return csv_field(is_scalar ? value.text : yaml::line_of(value));
}

// Returns the values of the first worlds as CSV: world, seed, and a column for each key.
std::string table_of(const WorldSampler& worlds, std::uint32_t count) {
  std::string table = "world,seed";
  for (const std::string& key : worlds.keys()) table += "," + csv_field(key);
  table += '\n';
  for (std::uint32_t world = 0; world < count; ++world) {
    table += fmt::format("{},{}", world, worlds.seed_of(world).value);
    for (const yaml::Node& value : worlds.values_of(world)) table += "," + csv_field(value);
    table += '\n';
  }
  return table;
}

void write_parquet(const std::string& table, const fs::path& scene, const fs::path& out) {
  const TemporaryFolder folder;
  const fs::path csv = folder.path() / "worlds.csv";
  write_text(csv, table);
  write_whole(out, [&](const fs::path& part) {
    run_python_module("groundray.foreign.parquet", {csv.string(), fs::absolute(part).string()},
                      scene, {.check = stop_if_interrupted});
  });
}

// Reads worlds as `generate` does before it loads any DEM or model.
void check_worlds(const fs::path& scene, std::uint32_t count) {
  for (std::uint32_t world = 0; world < count; ++world) {
    stop_if_interrupted();
    load_scene(scene, data_folder() / "sensors", world);
  }
}

void print_world(const SampleOptions& options, const WorldSampler& worlds) {
  const std::string text = yaml::text_of(worlds.scene_of(*options.index));
  if (options.is_checked) load_scene(options.scene, data_folder() / "sensors", options.index);
  if (options.out.empty()) {
    print_text(stdout, "{}", text);
    return;
  }
  write_text(options.out, text);
}

void print_worlds(const SampleOptions& options, const WorldSampler& worlds) {
  const std::uint32_t count = options.count.value_or(worlds.count());
  if (count > worlds.count()) {
    throw Error(
        "{}: --count {}: the scene has {} worlds; `count` of its block `worlds` limits them",
        options.scene.string(), count, worlds.count());
  }
  if (options.is_checked) check_worlds(options.scene, count);
  const std::string table = table_of(worlds, count);
  if (options.out.empty()) {
    print_text(stdout, "{}", table);
  } else if (file_ending(options.out) == ".parquet") {
    write_parquet(table, options.scene, options.out);
  } else {
    write_text(options.out, table);
  }
}

void sample(const SampleOptions& options) {
  if (!options.out.empty() && options.index) check_ending(options.out, {".yaml", ".yml"});
  if (!options.out.empty() && !options.index) check_ending(options.out, {".csv", ".parquet"});
  const WorldSampler worlds = sampling::load_worlds(options.scene);
  if (options.index) {
    print_world(options, worlds);
  } else {
    print_worlds(options, worlds);
  }
}

}  // namespace

Command add_sample_command(CLI::App& app) {
  const auto options = std::make_shared<SampleOptions>();
  CLI::App* command = app.add_subcommand(
      "sample", "Draw the values of a scene's worlds: a table of them, or the scene file of one");
  command->add_option("SCENE", options->scene, "Scene file with a block `worlds`")->required();
  auto* const index = command->add_option(
      "--index", options->index,
      "Print the scene file of this world, from 0; to be saved beside SCENE, as its paths begin "
      "there");
  index->check(whole());
  command->add_option("--count", options->count, "Print the first worlds only; by default, all")
      ->check(positive())
      ->excludes(index);
  command->add_option("-o,--output", options->out,
                      "File instead of standard output: .csv or .parquet; .yaml with --index");
  command->add_flag("--check", options->is_checked,
                    "Read the scene of each world, to find values that the scene's rules reject");
  return {command, [options] { sample(*options); }};
}

}  // namespace groundray
