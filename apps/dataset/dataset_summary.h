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

/// What a dataset is, and how much of it is there.
struct DatasetSummary {
  struct Sensor {
    std::string name, kind, model;  ///< name: as of a file. kind: "lidar" or "camera"
    std::int64_t frames = 0;        ///< of the whole run
    std::size_t asked_for = 0;      ///< of this shard; all of them, if it is none
    std::size_t done = 0;
    std::uint64_t bytes = 0;  ///< of its frames
  };
  std::string version;
  std::uint64_t seed = 0;
  std::optional<Shard> shard;
  std::vector<Sensor> sensors;          ///< by number
  std::size_t asked_for = 0, done = 0;  ///< frames of all sensors

  /// Returns where the files of a frame are: what their names begin with, in the dataset. Nothing
  /// if there is no such sensor.
  std::optional<std::string> stem_of(const FrameEntry& entry) const;
};

/// Reads dataset.yaml in a folder. Names of sensors are made sure of, for they name files.
/// @throws Error if that is at fault, or cannot be read.
DatasetSummary read_summary(const std::filesystem::path& folder);

}  // namespace groundray
