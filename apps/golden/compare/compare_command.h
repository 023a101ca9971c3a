#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "apps/golden/report.h"

namespace CLI {
class App;
}

namespace groundray::golden {

/// Command `compare`: compares a file with a reference and writes a report.
class CompareCommand {
 public:
  /// Adds the command to `app`, which must outlive this object.
  explicit CompareCommand(CLI::App& app);
  ~CompareCommand();

  bool is_asked_for() const;

  /// Compares the files, prints the figures, and writes report.html and report.json.
  /// @return Failed if a limit is exceeded or the inputs have nothing in common.
  /// @throws Error as compare_scans, compare_images, compare_dems and compare_meshes.
  Verdict run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
  CLI::App* command_;
};

}  // namespace groundray::golden
