#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace groundray {

/// Command `groundray terrain fill`: fills the blank areas of a DEM.
class FillCommand {
 public:
  /// Adds the command to `terrain`.
  explicit FillCommand(CLI::App& terrain);
  ~FillCommand();
  FillCommand(const FillCommand&) = delete;
  FillCommand& operator=(const FillCommand&) = delete;

  bool is_asked_for() const;

  /// Fills the DEM, writes the results and prints a report.
  /// @throws Error as load_dem, fill_dem and write_layers.
  void run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
};

}  // namespace groundray
