#include "apps/groundray/run/run_commands.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/generate.h"
#include "apps/groundray/run/merge.h"
#include "apps/groundray/run/verify.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Returns CLI11's message for a text that is not a shard; empty if it is one.
std::string check_shard(const std::string& text) {
  return parse_shard(text) ? "" : "'" + text + "' must be one of 1/N to N/N, such as 2/8";
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
  if (asked.verify->parsed()) return verify(asked.datasets);
  if (asked.merge->parsed()) return merge(asked.datasets, asked.out, use);
  generate(asked.scene, asked.out,
           {.seed = asked.seed ? std::optional(Seed{*asked.seed}) : std::nullopt,
            .use = use,
            .shard = parse_shard(asked.shard),
            .log = asked.log});
}

}  // namespace groundray
