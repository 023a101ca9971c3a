#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"

namespace groundray {

/// Scan that a .conf file names.
struct ConfScan {
  std::string file;  ///< name of a file in the folder of the .conf
  Pose X_DS;         ///< translation in the unit of the scans
};

/// Parses a .conf in the form of the Stanford 3D Scanning Repository: its lines
/// `bmesh FILE tx ty tz qx qy qz qw`; other lines are ignored. A line's quaternion rotates from D
/// to S, and so is the inverse of the rotation of X_DS.
/// @param name  name of the file, for messages.
/// @throws Error naming file and line unless numbers are finite and within 1e15, and quaternions
///         have length 1 up to rounding to three decimals.
std::vector<ConfScan> parse_conf(std::string_view text, const std::string& name);

}  // namespace groundray
