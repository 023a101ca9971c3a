#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"
#include "core/io/number_column.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// Contents of a PCD file.
struct PcdFile {
  PointCloud cloud{};  ///< a field NAME of several numbers becomes columns NAME_0, NAME_1, ...
  std::vector<ColumnOrigin> origins;  ///< constants to add to columns of 64-bit integers
  std::uint64_t width = 0;            ///< points per row; the cloud holds row after row
  std::uint64_t height = 0;           ///< number of rows; 1 for an unorganised cloud
  Pose X_FS;                          ///< VIEWPOINT: pose of the sensor in the frame of the points
};

/// Reads a file of the Point Cloud Library, version 0.7 or older: text, binary or compressed
/// binary. Padding fields, named `_`, are skipped.
/// @throws Error naming file, rule and, in text, the line if it is not a PCD file, is truncated, or
///         cannot be read.
/// @see Rusu, The PCD (Point Cloud Data) file format, pointclouds.org.
PcdFile read_pcd(const std::filesystem::path& path);

/// Parses bytes in memory as read_pcd does; `name` is the file name in error messages.
PcdFile parse_pcd(std::string_view bytes, const std::string& name);

/// Returns the `size` bytes that `packed` encodes in the format of Lehmann's LibLZF.
/// @throws Error if `packed` encodes more or fewer, or refers to bytes before the first.
std::string unpack_lzf(std::string_view packed, std::size_t size);

}  // namespace groundray
