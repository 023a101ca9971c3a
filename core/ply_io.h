#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/point_cloud.h"

namespace groundray {

/// A point cloud and the comment lines of its header.
struct PlyFile {
  PointCloud cloud;
  std::vector<std::string> comments;
};

/// Writes the cloud as the element `vertex` of a binary little-endian PLY file, a property for each
/// column, in order. Appears only when whole.
/// @throws Error if the file cannot be written, the name of a column holds anything but visible
/// ASCII characters, a
///         comment holds a line break, or there are rows but no column.
/// @see Turk, The PLY Polygon File Format (1994).
void write_ply(const std::filesystem::path& path, const PointCloud& cloud,
               const std::vector<std::string>& comments);

/// Reads the element `vertex` of a PLY file (binary little or big endian, or ASCII with a line for
/// each row). Elements before it are skipped over, lists and all; those after it are ignored.
/// @throws Error naming file, rule and, in text, the line if it is not one, is cut short, or holds
/// what cannot be read.
PlyFile read_ply(const std::filesystem::path& path);

/// As read_ply, of bytes already in memory; `name` stands for the file in messages.
PlyFile parse_ply(std::string_view bytes, const std::string& name);

}  // namespace groundray
