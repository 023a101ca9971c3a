#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "apps/golden/report.h"

namespace CLI {
class App;
}

namespace groundray::golden {

/// The command `compare`: holds one file against another and writes a report.
class CompareCommand {
 public:
  /// Adds the command to a program's.
  explicit CompareCommand(CLI::App& app);
  ~CompareCommand();

  bool is_asked_for() const;

  /// Writes report.html and report.json, and prints the figures.
  /// @return what was found: Failed if a limit is broken or they have nothing in common.
  /// @throws Error as compare_scans, compare_images, compare_dems and compare_meshes.
  Verdict run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
  CLI::App* command_;
};

}  // namespace groundray::golden
