#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/point_cloud.h"

namespace groundray {

/// Point cloud and comment lines of a PLY file.
struct PlyFile {
  PointCloud cloud;
  std::vector<std::string> comments;
};

/// Writes the cloud as the element `vertex` of a binary little-endian PLY file, with a property for
/// each column, in order. The file appears only when complete.
/// @throws Error if the file cannot be written, the name of a column contains anything but visible
///         ASCII characters, a comment contains a line break, or there are rows but no column.
/// @see Turk, The PLY Polygon File Format (1994).
void write_ply(const std::filesystem::path& path, const PointCloud& cloud,
               const std::vector<std::string>& comments);

/// Reads the element `vertex` of a PLY file (binary little or big endian, or ASCII with a line for
/// each row). Elements before it are skipped, lists included; those after it are ignored.
/// @throws Error naming file, rule and, in text, the line if it is not a PLY file, is truncated, or
///         cannot be read.
PlyFile read_ply(const std::filesystem::path& path);

/// Parses bytes in memory as read_ply does; `name` is the file name in error messages.
PlyFile parse_ply(std::string_view bytes, const std::string& name);

}  // namespace groundray
