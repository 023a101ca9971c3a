#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/scan/cloud_file.h"
#include "core/geometry/pose.h"

namespace groundray {

/// Request to use the sensor's pose that the file itself states (PCD's VIEWPOINT).
struct FileViewpoint {};

/// Properties that a file of points does not state.
struct ScanReading {
  double unit_m = 1;                       ///< unit of x, y and z
  std::optional<double> time_unit_s;       ///< default: by the column's name, or s for floats
  std::chrono::nanoseconds time_zero{};    ///< reading of the file's clock at the scan's stamp
  std::variant<Pose, FileViewpoint> X_FS;  ///< pose of the sensor in the points' frame, metres
  glm::dvec3 origin_w_m{0};                ///< origin of the points' frame in W; its axes are W's
  std::vector<std::string> columns;        ///< names for unnamed columns, as read_cloud
};

/// Quantities that a column may have, other than the position.
enum class Quantity {
  Intensity,
  Ring,
  Time,         ///< s since the scan's stamp
  ReturnIndex,  ///< from 1
  Pulse,
  Label,
  Incidence,  ///< rad
  Range,      ///< stored value; only compared with the position
  Column,     ///< column in a grid of rings and columns
  RangeSd     ///< m, standard deviation of the range
};
constexpr std::size_t quantity_count = 10;  ///< number of quantities

/// Column that was recognised.
struct ReadColumn {
  std::string theirs;  ///< its name in the file
  std::string ours;    ///< its name in docs/reference/formats.md
  std::string note;    ///< remark on its interpretation, or empty
};

/// Numbers of rows that are not returns, by kind.
/// @see REP 117: informational distance measurements.
struct NoReturns {
  std::size_t beyond = 0;   ///< +inf: nothing within range
  std::size_t near = 0;     ///< -inf: too near
  std::size_t invalid = 0;  ///< NaN
  std::size_t zero = 0;     ///< exactly at the origin, as stored by KITTI and Ouster
};

/// Returns of one scan from any source, in the sensor's frame S.
struct Scan {
  std::string name, form;
  std::size_t rows = 0;          ///< number of rows in the file
  ImageLayout image;             ///< layout of the file's rows
  std::vector<std::size_t> row;  ///< row in the file of each return
  std::vector<glm::dvec3> p_S;   ///< m
  std::array<std::optional<std::vector<double>>, quantity_count> values;  ///< by Quantity
  NoReturns no_returns;
  std::vector<ReadColumn> read;
  std::vector<std::string> unused;  ///< columns that were not recognised or not needed
  std::vector<std::string> notes;   ///< sentences for the user
  std::string frame;                ///< sentence about the points' frame
  Pose X_WS;                        ///< of the sensor, as far as pose and origin are given

  /// Returns the values of the returns, or null if the file has none.
  const std::vector<double>* find(Quantity quantity) const {
    const auto& found = values[static_cast<std::size_t>(quantity)];
    return found ? &*found : nullptr;
  }
};

/// Interprets the columns of a file by their names, in any common spelling, and removes rows that
/// are not returns.
/// @throws Error naming `name`, if x, y or z is missing, or a unit is not positive.
Scan scan_of(const CloudFile& file, const std::string& name, const ScanReading& reading);

/// Reads a file as read_cloud, and interprets it as scan_of.
Scan read_scan(const std::filesystem::path& path, const ScanReading& reading);

}  // namespace groundray
