#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"
#include "core/io/number_column.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// Layout of points that are an image, row by row; 0 by 0 for other points.
struct ImageLayout {
  std::uint64_t rows = 0, columns = 0;
};

/// Place of a scan that groundray exported: columns x, y and z are in S, and columns world_x,
/// world_y and world_z, if there are any, in D.
struct ScanPlace {
  Pose X_DS;                 ///< at the stamp of the scan
  glm::dvec3 origin_w_m{0};  ///< origin of D, in W
};

/// Contents of a file of points, with its own names of columns.
struct CloudFile {
  std::string form;  ///< name of the format: "PCD", "KITTI's, 4 floats a point"
  PointCloud cloud{};
  std::vector<ColumnOrigin> origins;  ///< offsets to be added to columns of 64-bit integers
  std::vector<std::string> unread;    ///< other contents, and why they are no columns
  std::optional<Pose> X_FS;           ///< pose of the sensor in the points' frame, if stated
  ImageLayout image{};
  std::optional<ScanPlace> place{};  ///< arrays X_DS and origin_w_m of a .npz, if it has them
};

/// Reads a cloud in the format of the file's extension: .ply, .pcd, .npy, .npz, or .bin
/// (little-endian floats, as KITTI's). Those in .las, .laz and .mcap (PointCloud2 of one topic,
/// which $GROUNDRAY_TOPIC chooses) are read by groundray's Python package, in a process of its own.
/// @param columns  names for the columns of .bin and of arrays without names; empty for x, y, z and
///                 intensity. An empty name omits a column.
/// @throws Error if it cannot be read, or is in a format that must be converted first: E57;
///         and as run_python_module. Throws Interrupted if that is interrupted.
CloudFile read_cloud(const std::filesystem::path& path, const std::vector<std::string>& columns);

/// Parses a cloud in memory as read_cloud; the extension of `name` determines the format, which may
/// not be one that Python reads.
CloudFile parse_cloud(std::string_view bytes, const std::string& name,
                      const std::vector<std::string>& columns);

}  // namespace groundray
