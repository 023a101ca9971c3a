#pragma once

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>

namespace groundray {

/// Options of every command that computes.
struct RunControls {
  std::optional<std::size_t> threads;  ///< most threads that compute; default: all cores
  bool is_quiet = false;               ///< true to print nothing on standard error but the error
  bool is_network_open = false;        ///< true to permit rasters on servers

  void add(CLI::App* command);
};

/// Applies controls during its lifetime. One at a time.
class AppliedControls {
 public:
  /// @throws std::system_error if standard error cannot be silenced.
  explicit AppliedControls(const RunControls& controls);
  ~AppliedControls();
  AppliedControls(const AppliedControls&) = delete;
  AppliedControls& operator=(const AppliedControls&) = delete;

 private:
  std::optional<tbb::global_control> threads_;
  int shown_ = -1;  // descriptor of standard error while it is silenced
};

}  // namespace groundray
