#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh_io.h"
#include "core/pose.h"
#include "core/trajectory.h"
#include "sensors/lidar_spec.h"

namespace groundray {

/// Some of numbered things: from `first` on, each `step`-th before `end`.
struct FrameRange {
  std::size_t first = 0;
  std::size_t end = std::numeric_limits<std::size_t>::max();
  std::size_t step = 1;

  bool contains(std::size_t number) const {
    return first <= number && number < end && (number - first) % step == 0;
  }
};

/// Reads `A:B:STEP`, parts of which may be left out, or the number of one frame.
/// @throws Error that names the option if it is neither, or takes no frame.
FrameRange parse_frames(std::string_view text, std::string_view option = "--frames");

/// How poses of a file belong to scans.
enum class PoseOrder {
  Line,  ///< the first pose to the first scan, and so on
  Name,  ///< by time, which each scan's name is
};

/// Whether a run can do without scans, for a dataset's stereo pairs measure as well.
enum class ScanNeed {
  Some,     ///< there must be one
  IfThere,  ///< but a dataset may have no lidar
  None,     ///< a dataset's lidars are left alone
};

/// Which scans there are, and what their files do not say of where they were made.
struct ScanChoice {
  std::vector<std::filesystem::path> inputs;  ///< a dataset, a .conf, or files of scans
  ScanNeed need = ScanNeed::Some;
  std::vector<std::string> sensors;  ///< of a dataset; empty for all its lidars
  FrameRange frames;
  std::optional<std::filesystem::path> poses;  ///< instead of a dataset's own
  PoseOrder order = PoseOrder::Line;
  double conf_unit_m = 1;                   ///< of the poses of a .conf: that of its scans
  std::optional<LidarSpec::Points> points;  ///< else as a dataset says, or at the stamp
};

/// One scan that is there to be read.
struct ScanFile {
  std::string name;  ///< for people
  std::filesystem::path file;
  Pose X_DS;                          ///< of the sensor at the stamp
  std::optional<std::size_t> path;    ///< of the sensor, among those of the run
  std::chrono::nanoseconds stamp{0};  ///< on the path's clock: a point's time is added to it
  LidarSpec::Points points = LidarSpec::Points::AtStamp;
  double range_noise_sigma_m = 0;  ///< where the scan itself does not tell
  bool is_range_grid = false;      ///< of Stanford's form, beams along z
};

/// The scans of a run.
struct ScanFiles {
  std::vector<ScanFile> scans;
  std::vector<Trajectory> paths;            ///< X_DS
  Georeference georeference;                ///< of D
  std::vector<std::filesystem::path> read;  ///< all files that say something of them
  std::vector<std::string> notes;           ///< for people: what was left out
  bool are_posed = true;                    ///< false: D is the frame of the one scan's sensor
};

/// Finds the scans and where each was made. Poses farther than 10 km from their zero get an origin
/// near the first of them, in whole metres.
/// @throws Error if there is no scan though one is needed, a scan has no pose, kinds of input are
///         mixed, or an option does not suit them; and as read_dataset and read_tum.
ScanFiles find_scans(const ScanChoice& choice);

}  // namespace groundray
