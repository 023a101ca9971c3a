#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// Command `groundray reconstruct dem` with its options.
class DemCommand {
 public:
  /// Adds the command to `reconstruct`, which must outlive this.
  explicit DemCommand(CLI::App& reconstruct);
  ~DemCommand();
  DemCommand(const DemCommand&) = delete;
  DemCommand& operator=(const DemCommand&) = delete;

  /// Returns true if the command line requests this command.
  bool is_asked_for() const;

  /// Runs the command.
  /// @throws Error as rebuild_dem, or if options contradict each other.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
