#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/scan/scan.h"

namespace CLI {
class App;
}

namespace groundray {

/// Command-line options about the contents of files of points.
class ScanFlags {
 public:
  /// Adds the options to a group, each name with `prefix` after the dashes.
  void add(CLI::App* group, const std::string& prefix);

  /// Returns the values of the options.
  /// @throws Error if the pose's quaternion is not of length 1, or the time zero is out of range.
  ScanReading reading() const;

  bool has_pose() const { return !pose_.empty(); }

 private:
  std::string whose_;  // the prefix
  double unit_m_ = 1;
  std::optional<double> time_unit_s_;
  double time_zero_s_ = 0;
  std::vector<double> pose_;
  bool viewpoint_ = false;
  std::vector<std::string> columns_;
};

}  // namespace groundray
