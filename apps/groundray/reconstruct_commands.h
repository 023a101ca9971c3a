#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// Command `groundray reconstruct`: meshes and DEMs from measurements, and operations on meshes.
class ReconstructCommands {
 public:
  /// Adds the command to `app`.
  explicit ReconstructCommands(CLI::App& app);
  ~ReconstructCommands();
  ReconstructCommands(const ReconstructCommands&) = delete;
  ReconstructCommands& operator=(const ReconstructCommands&) = delete;

  bool is_asked_for() const;

  /// Runs the requested command: writes the results and prints a report.
  /// @throws Error as rebuild_mesh, finish_mesh and DemCommand::run.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
