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
#include "core/pose.h"

namespace groundray {

/// The points' frame is the sensor's by the pose that the file itself tells (PCD's VIEWPOINT).
struct FileViewpoint {};

/// What a file of points does not say of itself.
struct ScanReading {
  double unit_m = 1;                     ///< of its x, y and z
  std::optional<double> time_unit_s;     ///< of its time; else as its name says, floats in seconds
  std::chrono::nanoseconds time_zero{};  ///< what its clock shows when the scan's stamp is
  std::variant<Pose, FileViewpoint> X_FS;  ///< pose of the sensor in the points' frame, metres
  std::vector<std::string> columns;        ///< names for columns without, as read_cloud
};

/// What a column may tell besides the position.
enum class Quantity {
  Intensity,
  Ring,
  Time,         ///< s since the scan's stamp
  ReturnIndex,  ///< from 1
  Pulse,
  Label,
  Incidence,  ///< rad
  Range,      ///< as stored: held against the position alone
  Column,     ///< of a scan whose beams lie on a grid of rings and columns
  RangeSd     ///< m, standard deviation of the range
};
constexpr std::size_t quantity_count = 10;

/// A column that was understood.
struct ReadColumn {
  std::string theirs;  ///< its name in the file
  std::string ours;    ///< its name in docs/formats.md
  std::string note;    ///< how it was read, if there is something to say
};

/// Rows that are no returns, by their kind.
/// @see REP 117: informational distance measurements.
struct NoReturns {
  std::size_t beyond = 0;   ///< +inf: nothing within range
  std::size_t near = 0;     ///< -inf: too near
  std::size_t invalid = 0;  ///< NaN
  std::size_t zero = 0;     ///< exactly at the origin, as KITTI and Ouster have them
};

/// The returns of one scan, whoever made it, in the frame S of the sensor.
struct Scan {
  std::string name, form;
  std::size_t rows = 0;          ///< of the file
  ImageLayout image;             ///< of the file's rows
  std::vector<std::size_t> row;  ///< of each return: its row in the file
  std::vector<glm::dvec3> p_S;   ///< m
  std::array<std::optional<std::vector<double>>, quantity_count> values;  ///< by Quantity
  NoReturns no_returns;
  std::vector<ReadColumn> read;
  std::vector<std::string> unused;  ///< columns that were not understood or not needed
  std::vector<std::string> notes;   ///< sentences on what the reader should know
  std::string frame;                ///< sentence on how points came into the sensor's frame

  /// Returns the values of the returns, or null if the file has none.
  const std::vector<double>* find(Quantity quantity) const {
    const auto& found = values[static_cast<std::size_t>(quantity)];
    return found ? &*found : nullptr;
  }
};

/// Takes the columns of a file for what their names say in any common spelling, and sorts the
/// returns from other rows.
/// @throws Error naming `name`, if x, y or z is missing, or a unit is not positive.
Scan scan_of(const CloudFile& file, const std::string& name, const ScanReading& reading);

/// Reads a file as read_cloud, and takes it as scan_of.
Scan read_scan(const std::filesystem::path& path, const ScanReading& reading);

}  // namespace groundray
