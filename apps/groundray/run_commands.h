#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// Commands `generate`, `verify` and `merge`, which make, check and join datasets.
class RunCommands {
 public:
  /// Adds the commands to `app`.
  explicit RunCommands(CLI::App& app);
  ~RunCommands();
  RunCommands(const RunCommands&) = delete;
  RunCommands& operator=(const RunCommands&) = delete;

  bool is_asked_for() const;

  /// Runs the requested command.
  /// @throws Error as generate, verify and merge; Interrupted.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
