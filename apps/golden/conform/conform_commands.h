#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <vector>

#include "apps/golden/conform/pass_folder.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Prints the figures of a report, and writes report.html and report.json into a folder.
void publish(const Report& report, const std::filesystem::path& out);

/// Command `passes`: writes what the passes of the mesher and rays yield for a DEM.
struct PassesCommand {
  std::filesystem::path dem, out;
  PassSettings settings;
  std::vector<double> viewpoint_m;

  void add_to(CLI::App* command);
  void run();
};

/// Command `conform`: judges what another mesher or tracer made of it.
struct ConformCommand {
  std::filesystem::path passes, theirs;
  std::filesystem::path out = "out/conform";

  void add_to(CLI::App* command);
  Verdict run() const;
};

}  // namespace groundray::golden
