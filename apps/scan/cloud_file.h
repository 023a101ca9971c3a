#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/number_column.h"
#include "core/point_cloud.h"
#include "core/pose.h"

namespace groundray {

/// Of points that are an image, row by row; 0 by 0 of others.
struct ImageLayout {
  std::uint64_t rows = 0, columns = 0;
};

/// A file of points as it is: its columns by its own names.
struct CloudFile {
  std::string form;  ///< for people: "PCD", "KITTI, four floats a point"
  PointCloud cloud{};
  std::vector<ColumnOrigin> origins;  ///< what is to be added to columns of 64-bit whole numbers
  std::vector<std::string> unread;    ///< what else is in it, and why it is no column
  std::optional<Pose> X_FS;           ///< pose of the sensor in the points' frame, if it is told
  ImageLayout image{};
};

/// Reads a cloud by the ending of its name: .ply, .pcd, .npy, .npz, and .bin (floats, little
/// endian, as KITTI has them).
/// @param columns  names for the columns of .bin and of arrays without names; empty for x, y, z and
///                 intensity. An empty name leaves a column out.
/// @throws Error if it cannot be read, or is of a form that must be converted first: LAS, E57.
CloudFile read_cloud(const std::filesystem::path& path, const std::vector<std::string>& columns);

/// As read_cloud, of bytes already in memory, by the ending of `name`.
CloudFile parse_cloud(std::string_view bytes, const std::string& name,
                      const std::vector<std::string>& columns);

}  // namespace groundray
