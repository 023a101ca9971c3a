#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/frame_entry.h"
#include "apps/dataset/run_part.h"
#include "core/geometry/trajectory.h"
#include "core/io/mesh_io.h"
#include "sensors/lidar/lidar_spec.h"

namespace groundray {

/// Suffix of scan files.
inline constexpr std::string_view scan_suffix = ".ply";

/// Finished scan or image.
struct RecordedFrame {
  std::int64_t number = 0;
  std::chrono::nanoseconds stamp{0};
  std::filesystem::path file;
};

/// Part of dataset.yaml before the frames (docs/reference/formats.md).
struct DatasetHead {
  /// Lidar, camera, or a sensor of another program.
  struct Sensor {
    std::string name, kind;    ///< kind: "lidar", "camera", or a word of another program
    std::string model;         ///< read for HeadUse::Run only
    std::uint32_t frames = 0;  ///< number of frames in a whole run; 0 if not stated
  };
  /// Names of a stereo pair and of its cameras.
  struct Pair {
    std::string name, left, right;
  };
  /// Objects of an entry of the scene file.
  struct Objects {
    std::string name;
    std::uint16_t label = 0;
    std::uint32_t first = 1, count = 0;  ///< instances: first number and count
  };

  std::string version;                 ///< for HeadUse::Run only
  std::uint64_t seed = 0;              ///< for HeadUse::Run only
  Georeference georeference;           ///< not for HeadUse::Run
  std::vector<Sensor> sensors;         ///< lidars and cameras
  std::vector<Pair> pairs;             ///< not for HeadUse::Run
  std::string scene;                   ///< for HeadUse::Names only: text of the scene file
  std::vector<std::string> materials;  ///< for HeadUse::Names only; the first has number 1
  std::vector<Objects> objects;        ///< for HeadUse::Names only

  /// Returns the names of the sensors of a kind.
  std::vector<std::string> names_of(std::string_view kind) const;
};

/// Purpose of reading a head. Faults in keys that it does not need are ignored: other programs may
/// have written them.
enum class HeadUse {
  Frames,  ///< to use scans and images: the origin is required
  Names,   ///< as Frames, and to name the numbers of labels, instances and materials
  Run,  ///< to check or extend a run: version, seed, numbers of frames, and names of sensors that
        ///< are valid as names of files are required
};

/// Contents of a dataset's dataset.yaml.
struct DatasetListing {
  /// Frames of a sensor.
  struct Frames {
    std::vector<RecordedFrame> done;  ///< sorted by number; read_listing leaves `file` empty
    std::size_t pending = 0;          ///< number of frames that are not finished
  };

  DatasetHead head;
  std::map<std::string, Frames> frames;  ///< key: name of the sensor

  /// Returns the frames of a sensor; empty if none are listed.
  Frames frames_of(const std::string& sensor) const;
};

/// Reads dataset.yaml in a folder: any number of frames if the file is as the generator writes it,
/// else at most 16 MiB of any other YAML. Keys for other programs are ignored.
/// @param use  Frames or Names.
/// @throws Error naming file, line and rule of each fault.
DatasetListing read_listing(const std::filesystem::path& folder, HeadUse use = HeadUse::Frames);

/// Scans of a lidar in a dataset.
struct RecordedLidar {
  std::string name;
  Trajectory X_DS;
  LidarSpec::Points points = LidarSpec::Points::AsFired;
  double range_noise_sigma_m = 0;     ///< standard deviation, without the receiver's noise
  std::vector<RecordedFrame> frames;  ///< sorted by number
  std::size_t pending = 0;            ///< number of frames that are not finished
};

/// Lidars of a dataset folder.
struct RecordedDataset {
  Georeference georeference;
  std::vector<RecordedLidar> lidars;
};

/// Reads dataset.yaml, and the poses and calibration of each lidar; does not open the scans.
/// @throws Error naming file, line and rule of each fault.
RecordedDataset read_dataset(const std::filesystem::path& folder);

/// Summary of a dataset: its sensors, and the numbers of requested and finished frames.
struct DatasetSummary {
  /// Lidar or camera.
  struct Sensor {
    std::string name, kind, model;  ///< name: also of its files; kind: "lidar" or "camera"
    std::int64_t frames = 0;        ///< number of frames of the whole run, or of the choice
    std::size_t asked_for = 0;      ///< number of frames of the shard, or of the whole run
    std::size_t done = 0;
    std::uint64_t bytes = 0;         ///< size of its frames' files
    std::set<std::int64_t> counted;  ///< numbers of its frames
  };
  std::string version;
  std::uint64_t seed = 0;
  RunPart part;
  std::vector<Sensor> sensors;  ///< indexed by the sensor's number, unless sensors were chosen
  std::size_t asked_for = 0, done = 0;  ///< numbers of frames of all sensors

  /// Returns the number of the sensor of that name, if there is one.
  std::optional<std::size_t> number_of(std::string_view sensor) const;
  /// Returns the common beginning of the paths of a frame's files, relative to the dataset; nothing
  /// for an unknown sensor.
  std::optional<std::string> stem_of(const FrameEntry& entry) const;
  /// Returns true if a sensor has a frame of this number in the whole run or in the choice.
  bool has(const Sensor& sensor, std::int64_t frame) const noexcept;
  /// Counts a finished frame, once; nothing that is not a frame of one of the sensors.
  void add(const FrameEntry& entry);
};

/// Reads dataset.yaml in a folder. Checks the names of sensors, because they are names of files.
/// @throws Error if the file is invalid or cannot be read.
DatasetSummary read_summary(const std::filesystem::path& folder);

/// Converts seconds to nanoseconds, rounded.
std::chrono::nanoseconds time_of(double time_s);

}  // namespace groundray
