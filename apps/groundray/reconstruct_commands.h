#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// The command `reconstruct`: meshes from scans, and what can be done to a mesh.
class ReconstructCommands {
 public:
  /// Adds the command to a program's.
  explicit ReconstructCommands(CLI::App& app);
  ~ReconstructCommands();
  ReconstructCommands(const ReconstructCommands&) = delete;
  ReconstructCommands& operator=(const ReconstructCommands&) = delete;

  bool is_asked_for() const;

  /// Does what was asked for, writes the mesh and prints what was done.
  /// @throws Error as rebuild_mesh and finish_mesh.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
