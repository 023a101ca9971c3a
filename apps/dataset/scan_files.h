#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"
#include "core/io/mesh_io.h"
#include "sensors/lidar/lidar_spec.h"

namespace groundray {

/// Range of numbers: every `step`-th number from `first`, below `end`.
struct FrameRange {
  std::size_t first = 0;
  std::size_t end = std::numeric_limits<std::size_t>::max();
  std::size_t step = 1;

  bool contains(std::size_t number) const {
    return first <= number && number < end && (number - first) % step == 0;
  }
};

/// Parses `A:B:STEP`, of which parts may be omitted, or the number of one frame.
/// @throws Error naming the option if the text has neither form, or selects no frame.
FrameRange parse_frames(std::string_view text, std::string_view option = "--frames");

/// Assignment of the poses in a file to scans.
enum class PoseOrder {
  Line,  ///< the first pose belongs to the first scan, and so on
  Name,  ///< each file's name is its stamp
};

/// Need for lidar scans; a dataset's stereo pairs provide measurements as well.
enum class ScanNeed {
  Some,     ///< at least one scan is required
  IfThere,  ///< required, unless a dataset has no lidar
  None,     ///< a dataset's lidars are ignored
};

/// Selection of scans, with information that their files lack.
struct ScanChoice {
  std::vector<std::filesystem::path> inputs;  ///< a dataset, a .conf, or scan files
  ScanNeed need = ScanNeed::Some;
  std::vector<std::string> sensors;  ///< lidars of a dataset; empty for all
  FrameRange frames;
  std::optional<std::filesystem::path> poses;  ///< replaces a dataset's own poses
  PoseOrder order = PoseOrder::Line;
  double conf_unit_m = 1;  ///< unit of a .conf's poses, which is that of its scans, m
  std::optional<LidarSpec::Points> points;  ///< default: as a dataset states, else AtStamp
};

/// Scan to be read.
struct ScanFile {
  std::string name;  ///< name in messages
  std::filesystem::path file;
  Pose X_DS;                          ///< pose of the sensor at the stamp
  std::optional<std::size_t> path;    ///< index of the sensor's trajectory in ScanFiles::paths
  std::chrono::nanoseconds stamp{0};  ///< time on the trajectory's clock; origin of points' times
  LidarSpec::Points points = LidarSpec::Points::AtStamp;
  double range_noise_sigma_m = 0;  ///< used if the scan itself has none
  bool is_range_grid = false;      ///< true for Stanford's range grids, with beams along z
};

/// Returns the first of several names, and how many there are besides.
inline std::string first_and_count(std::string_view first, std::size_t count) {
  return count > 1 ? fmt::format("{} and {} more", first, count - 1) : std::string(first);
}

/// Scans of a run.
struct ScanFiles {
  std::vector<ScanFile> scans;
  std::vector<Trajectory> paths;            ///< trajectories X_DS of the sensors
  Georeference georeference;                ///< georeference of D
  std::vector<std::filesystem::path> read;  ///< all input files
  std::vector<std::string> notes;           ///< messages about omitted frames
  bool are_posed = true;                    ///< false if D is the frame of the single scan's sensor
};

/// Finds the scans and their poses. Except for datasets, if the first pose is farther than 10 km
/// from the origin, D's origin is moved there, rounded to whole metres.
/// @throws Error if there is no scan though one is required, a scan has no pose, kinds of input are
///         mixed, or an option does not suit the input; and as read_dataset and read_tum.
ScanFiles find_scans(const ScanChoice& choice);

}  // namespace groundray
