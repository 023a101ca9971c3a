#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "apps/dataset/write/merge.h"
#include "apps/dataset/write/verify.h"
#include "apps/groundray/command.h"
#include "apps/groundray/generate.h"
#include "apps/scan/number_checks.h"
#include "core/error.h"
#include "core/io/print_error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Returns CLI11's message for a text that is not a shard; empty if it is one.
std::string check_shard(const std::string& text) {
  return parse_shard(text) ? "" : "'" + text + "' must be one of 1/N to N/N, such as 2/8";
}

double mebibytes(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

// Prints the faults of a dataset and their number.
Verification verify_one(const fs::path& folder) {
  const auto report = [](const std::string& fault) {
    print_text(stdout, "{}\n", fault);
    std::fflush(stdout);
  };
  const Verification found = verify(folder, report, stderr);
  print_text(stdout, "{}: {} files of {:.1f} MiB checked, {}\n", folder.string(), found.files,
             mebibytes(found.bytes),
             found.faults == 0
                 ? "all unchanged"
                 : fmt::format("{} fault{}", found.faults, found.faults == 1 ? "" : "s"));
  return found;
}

void verify_all(const std::vector<fs::path>& datasets) {
  const bool is_alone = datasets.size() == 1;
  std::size_t at_fault = 0;
  for (const fs::path& dataset : datasets) {
    bool is_sound = false;
    try {
      const Verification found = verify_one(dataset);
      is_sound = found.faults == 0;
      if (is_alone && found.is_unfinished())
        throw Error(
            "{}: unfinished: {} of {} frames are complete; --resume of `groundray "
            "generate`, or of `groundray merge` if that was interrupted, adds the rest",
            dataset.string(), found.done, found.asked_for);
    } catch (const Error& error) {
      if (is_alone) throw;
      print_text(stdout, "{}\n", error.what());
    } catch (const std::system_error& error) {
      print_text(stdout, "{}: {}\n", dataset.string(), error.what());
    }
    if (!is_sound) ++at_fault;
  }
  if (at_fault > 0) {
    throw Error(
        "{} of {} datasets {} damaged or incomplete; `groundray generate --resume` creates frames "
        "again",
        at_fault, datasets.size(), at_fault == 1 ? "is" : "are");
  }
}

void merge_shards(const std::vector<fs::path>& shards, const fs::path& out, FolderUse use) {
  const auto warn = [](const std::string& warning) { print_error("{}\n", warning); };
  const auto [frames, bytes] = merge(shards, out, use, {.progress = stderr, .warn = warn});
  print_text(stdout, "{} frames of {} shards, {:.1f} MiB\ndataset: {}\n", frames, shards.size(),
             mebibytes(bytes), out.string());
}

// Options of the commands for runs.
struct RunOptions {
  fs::path scene, out;
  bool resume = false;
  std::optional<std::uint64_t> seed;
  std::optional<std::uint32_t> world;
  std::string shard, log, frames;
  std::vector<std::string> sensors;
  std::vector<fs::path> datasets;

  // @throws Error as parse_frames.
  RunPart part() const {
    RunPart part{.shard = parse_shard(shard), .choice = {.sensors = sensors, .frames = {}}};
    if (!frames.empty()) part.choice.frames = parse_frames(frames);
    return part;
  }
  FolderUse use() const { return resume ? FolderUse::Resume : FolderUse::New; }

  CLI::App* add_generate(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "generate",
        "Run a scene and write its dataset: scans, images, poses, calibration, pictures");
    command->add_option("SCENE", scene, "Scene file (YAML, see docs/reference/scene.md)")
        ->required();
    command->add_option("-o,--output", out, "Folder for the dataset; created if missing")
        ->required();
    auto* const of_seed = command->add_option(
        "--seed", seed, "Seed of noise and scattered objects, instead of the scene's");
    of_seed->check(whole());
    command
        ->add_option("--world", world,
                     "Number, from 0: make this one of the scene's worlds, whose values are drawn "
                     "(docs/reference/sampling.md)")
        ->check(whole())
        ->excludes(of_seed);
    command->add_flag("--resume", resume,
                      "Continue an interrupted run in its folder: check all existing files and "
                      "create those that are missing or changed");
    auto* sensor =
        command->add_option("--sensor", sensors, "Make the frames of these sensors only: NAME,NAME")
            ->delimiter(',')
            ->allow_extra_args(false)
            ->type_name("NAME");
    auto* range =
        command
            ->add_option("--frames", frames,
                         "A:B:STEP, make these frames of each sensor only, from A to before B; or "
                         "one number")
            ->type_name("A:B:STEP");
    command
        ->add_option("--shard", shard,
                     "I/N, I from 1 to N: make shard I of N of the frames, in a separate folder; "
                     "`groundray merge` joins them")
        ->check(check_shard)
        ->type_name("I/N")
        ->excludes(sensor)
        ->excludes(range);
    command->add_option("--log-json", log,
                        "File that receives a line of JSON for each frame, or - for standard "
                        "output (docs/reference/runs.md)");
    return command;
  }

  CLI::App* add_verify(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "verify", "Check every file of datasets against the checksums in their dataset.yaml");
    command->add_option("DATASET", datasets, "Folders that `generate` or `merge` wrote")
        ->required();
    return command;
  }

  CLI::App* add_merge(CLI::App& app) {
    CLI::App* command =
        app.add_subcommand("merge", "Join the shards of a run into the dataset of a single run");
    command->add_option("SHARD", datasets, "Folders of all shards")->required();
    command->add_option("-o,--output", out, "Folder for the dataset; created if missing")
        ->required();
    command->add_flag("--resume", resume, "Continue an interrupted merge in its folder");
    return command;
  }
};

}  // namespace

void add_run_commands(CLI::App& app, std::vector<Command>& commands) {
  const auto options = std::make_shared<RunOptions>();
  commands.push_back(
      {options->add_generate(app), [options] {
         generate(options->scene, options->out,
                  {.seed = options->seed ? std::optional(Seed{*options->seed}) : std::nullopt,
                   .world = options->world,
                   .use = options->use(),
                   .part = options->part(),
                   .log = options->log});
       }});
  commands.push_back({options->add_verify(app), [options] { verify_all(options->datasets); }});
  commands.push_back({options->add_merge(app), [options] {
                        merge_shards(options->datasets, options->out, options->use());
                      }});
}

}  // namespace groundray
