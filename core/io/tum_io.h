#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/geometry/trajectory.h"

namespace groundray {

/// Reads a trajectory in TUM format: lines of `t x y z qx qy qz qw`, in seconds and metres; lines
/// that begin with # are comments. Times are read as decimals, exact to the nanosecond, and must be
/// within 4.6e9 s of zero. Quaternions are normalised; their norm may be off by 1e-3, because files
/// often have only four decimals.
/// @throws Error naming file, line and rule for each invalid line (the first 100), or as the
///         constructor of Trajectory.
/// @see Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems (2012).
Trajectory read_tum(const std::filesystem::path& path);

/// Parses text in memory as read_tum does; `name` is the file name in error messages.
Trajectory parse_tum(std::string_view text, const std::string& name);

/// Writes a trajectory in TUM format: seconds with 9 decimals, other numbers with 17 significant
/// digits. Reading it back gives the same times and positions, and rotations up to rounding. The
/// lines of `comment` come first, if it is not empty.
/// @throws Error as write_whole.
void write_tum(const std::filesystem::path& path, const Trajectory& trajectory,
               std::string_view comment);

}  // namespace groundray
