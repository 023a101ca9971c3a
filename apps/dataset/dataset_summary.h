#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/frame_entry.h"
#include "apps/dataset/shard.h"

namespace groundray {

/// Summary of a dataset: its sensors, and the numbers of requested and finished frames.
struct DatasetSummary {
  struct Sensor {
    std::string name, kind, model;  ///< name: also of its files; kind: "lidar" or "camera"
    std::int64_t frames = 0;        ///< number of frames of the whole run
    std::size_t asked_for = 0;      ///< number of frames of the shard, or of the whole run
    std::size_t done = 0;
    std::uint64_t bytes = 0;  ///< size of its frames' files
  };
  std::string version;
  std::uint64_t seed = 0;
  std::optional<Shard> shard;
  std::vector<Sensor> sensors;          ///< indexed by the sensor's number
  std::size_t asked_for = 0, done = 0;  ///< numbers of frames of all sensors

  /// Returns the common beginning of the paths of a frame's files, relative to the dataset; nothing
  /// for an unknown sensor.
  std::optional<std::string> stem_of(const FrameEntry& entry) const;
};

/// Reads dataset.yaml in a folder. Checks the names of sensors, because they are names of files.
/// @throws Error if the file is invalid or cannot be read.
DatasetSummary read_summary(const std::filesystem::path& folder);

}  // namespace groundray
