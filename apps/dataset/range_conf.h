#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/pose.h"

namespace groundray {

/// A scan that a .conf names.
struct ConfScan {
  std::string file;  ///< beside the .conf
  Pose X_DS;         ///< in the unit of the scans
};

/// Reads a .conf as those of the Stanford 3D Scanning Repository: of its lines those that are
/// `bmesh FILE tx ty tz qx qy qz qw`. The rotation of a line takes D's axes to the scan's.
/// @param name  of the file, for messages.
/// @throws Error naming file and line: numbers must be finite and within 1e15, and quaternions of
///         length 1 but for what three decimals leave.
std::vector<ConfScan> parse_conf(std::string_view text, const std::string& name);

}  // namespace groundray
