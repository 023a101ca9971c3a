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

/// The options that say which scans, and how their files are to be read.
struct ScanOptions {
  ScanChoice choice;
  ScanTaking taking;
  ScanFlags columns;
  std::string frames = ":";
  bool leaves_labels = false;

  void add(CLI::App* command);
  /// Which of the points are neighbours, for who links them.
  void add_grid(CLI::App* command);
  /// Call it once the line is read. @throws Error as parse_frames and ScanFlags.
  void close();

 private:
  void add_poses(CLI::App* scans);
};

}  // namespace groundray
