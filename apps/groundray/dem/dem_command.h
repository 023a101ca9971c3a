#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// The command `groundray reconstruct dem`: its options, and what they do.
class DemCommand {
 public:
  /// Adds itself to `reconstruct`, which must outlive this.
  explicit DemCommand(CLI::App& reconstruct);
  ~DemCommand();
  DemCommand(const DemCommand&) = delete;
  DemCommand& operator=(const DemCommand&) = delete;

  /// Whether the command line asks for it.
  bool is_asked_for() const;

  /// @throws Error as rebuild_dem, or if options contradict each other.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
