#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// The commands `generate`, `verify` and `merge`: datasets made, checked and joined.
class RunCommands {
 public:
  /// Adds the commands to a program's.
  explicit RunCommands(CLI::App& app);
  ~RunCommands();
  RunCommands(const RunCommands&) = delete;
  RunCommands& operator=(const RunCommands&) = delete;

  bool is_asked_for() const;

  /// Does what was asked for. @throws Error as generate, verify and merge; Interrupted.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
