#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/number_column.h"
#include "core/point_cloud.h"
#include "core/pose.h"

namespace groundray {

/// What a PCD file holds.
struct PcdFile {
  PointCloud cloud{};  ///< a field of several numbers NAME becomes columns NAME_0, NAME_1, ...
  std::vector<ColumnOrigin> origins;  ///< what is to be added to columns of 64-bit whole numbers
  std::uint64_t width = 0;            ///< rows of the cloud are row by row of an image
  std::uint64_t height = 0;           ///< 1 of a cloud without order
  Pose X_FS;                          ///< VIEWPOINT: pose of the sensor in the frame of the points
};

/// Reads a file of the Point Cloud Library, version 0.7 or older: text, binary, or binary and
/// compressed. Fields that only fill space, named `_`, are passed over.
/// @throws Error naming file, rule and, in text, the line if it is not one, is cut short, or holds
/// what cannot be read.
/// @see Rusu, The PCD (Point Cloud Data) file format, pointclouds.org.
PcdFile read_pcd(const std::filesystem::path& path);

/// As read_pcd, of bytes already in memory; `name` stands for the file in messages.
PcdFile parse_pcd(std::string_view bytes, const std::string& name);

}  // namespace groundray
