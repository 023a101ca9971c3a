#include "apps/groundray/run_commands.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "apps/dataset/write/merge.h"
#include "apps/dataset/write/verify.h"
#include "apps/groundray/generate.h"
#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Returns CLI11's message for a text that is not a shard; empty if it is one.
std::string check_shard(const std::string& text) {
  return parse_shard(text) ? "" : "'" + text + "' must be one of 1/N to N/N, such as 2/8";
}

double mebibytes(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

// Prints the faults of a dataset and their number; returns true if there are none.
bool verify_one(const fs::path& folder) {
  const auto report = [](const std::string& fault) {
    fmt::print("{}\n", fault);
    std::fflush(stdout);
  };
  const auto [files, faults, bytes] = verify(folder, report, stderr);
  fmt::print(
      "{}: {} files of {:.1f} MiB checked, {}\n", folder.string(), files, mebibytes(bytes),
      faults == 0 ? "all unchanged" : fmt::format("{} fault{}", faults, faults == 1 ? "" : "s"));
  return faults == 0;
}

void verify_all(const std::vector<fs::path>& datasets) {
  std::size_t at_fault = 0;
  for (const fs::path& dataset : datasets) {
    bool is_sound = false;
    try {
      is_sound = verify_one(dataset);
    } catch (const Error& error) {
      fmt::print("{}\n", error.what());
    } catch (const std::system_error& error) {
      fmt::print("{}: {}\n", dataset.string(), error.what());
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
  const auto warn = [](const std::string& warning) { fmt::print(stderr, "{}\n", warning); };
  const auto [frames, bytes] = merge(shards, out, use, {.progress = stderr, .warn = warn});
  fmt::print("{} frames of {} shards, {:.1f} MiB\ndataset: {}\n", frames, shards.size(),
             mebibytes(bytes), out.string());
}

}  // namespace

struct RunCommands::Options {
  CLI::App *generate = nullptr, *verify = nullptr, *merge = nullptr;
  fs::path scene, out;
  bool resume = false;
  std::optional<std::uint64_t> seed;
  std::string shard, log;
  std::vector<fs::path> datasets;

  void add_generate(CLI::App& app) {
    generate = app.add_subcommand(
        "generate",
        "Run a scene and write its dataset: scans, images, poses, calibration, pictures");
    generate->add_option("SCENE", scene, "Scene file (YAML, see docs/reference/scene.md)")
        ->required();
    generate->add_option("-o,--output", out, "Folder for the dataset; created if missing")
        ->required();
    generate->add_option("--seed", seed,
                         "Seed of noise and scattered objects, instead of the scene's");
    generate->add_flag("--resume", resume,
                       "Continue an interrupted run in its folder: check all existing files and "
                       "create those that are missing or changed");
    generate
        ->add_option("--shard", shard,
                     "I/N, I from 1 to N: make shard I of N of the frames, in a separate folder; "
                     "`groundray merge` joins them")
        ->check(check_shard);
    generate->add_option("--log-json", log,
                         "File that receives a line of JSON for each frame, or - for standard "
                         "output (docs/reference/runs.md)");
  }

  void add_verify(CLI::App& app) {
    verify = app.add_subcommand(
        "verify", "Check every file of datasets against the checksums in their dataset.yaml");
    verify->add_option("DATASET", datasets, "Folders that `generate` or `merge` wrote")->required();
  }

  void add_merge(CLI::App& app) {
    merge =
        app.add_subcommand("merge", "Join the shards of a run into the dataset of a single run");
    merge->add_option("SHARD", datasets, "Folders of all shards")->required();
    merge->add_option("-o,--output", out, "Folder for the dataset; created if missing")->required();
    merge->add_flag("--resume", resume, "Continue an interrupted merge in its folder");
  }
};

RunCommands::RunCommands(CLI::App& app) : options_(std::make_unique<Options>()) {
  options_->add_generate(app);
  options_->add_verify(app);
  options_->add_merge(app);
}

RunCommands::~RunCommands() = default;

bool RunCommands::is_asked_for() const {
  return options_->generate->parsed() || options_->verify->parsed() || options_->merge->parsed();
}

void RunCommands::run() const {
  const Options& asked = *options_;
  const FolderUse use = asked.resume ? FolderUse::Resume : FolderUse::New;
  if (asked.verify->parsed()) return verify_all(asked.datasets);
  if (asked.merge->parsed()) return merge_shards(asked.datasets, asked.out, use);
  generate(asked.scene, asked.out,
           {.seed = asked.seed ? std::optional(Seed{*asked.seed}) : std::nullopt,
            .use = use,
            .shard = parse_shard(asked.shard),
            .log = asked.log});
}

}  // namespace groundray
