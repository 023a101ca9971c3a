#pragma once

#include <string>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/scan_flags.h"

namespace CLI {
class App;
}

namespace groundray {

/// Options that select scans and control the reading of their files.
struct ScanOptions {
  ScanChoice choice;
  ScanTaking taking;
  ScanFlags columns;
  std::string frames = ":";
  bool leaves_labels = false;

  void add(CLI::App* command);
  /// Adds the option that defines neighbouring points, for commands that link them.
  void add_grid(CLI::App* command);
  /// Completes `choice` and `taking`; to be called after the command line has been parsed.
  /// @throws Error as parse_frames and ScanFlags.
  void close();

 private:
  void add_poses(CLI::App* scans);
};

}  // namespace groundray
