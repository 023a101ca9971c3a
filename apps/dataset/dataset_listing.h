#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/mesh_io.h"

namespace groundray {

/// Suffix of scan files.
inline constexpr std::string_view scan_suffix = ".ply";

/// Finished scan or image.
struct RecordedFrame {
  std::int64_t number = 0;
  std::chrono::nanoseconds stamp{0};
  std::filesystem::path file;
};

/// Contents of a dataset's dataset.yaml (docs/reference/formats.md).
struct DatasetListing {
  struct Pair {
    std::string name, left, right;  ///< names of the pair and of its cameras
  };
  struct Frames {
    std::vector<RecordedFrame> done;  ///< sorted by number; read_listing leaves `file` empty
    std::size_t pending = 0;          ///< number of frames that are not finished
  };

  Georeference georeference;
  std::vector<std::string> lidars, cameras;
  std::vector<Pair> pairs;
  std::map<std::string, Frames> frames;  ///< key: name of the sensor

  /// Returns the frames of a sensor; empty if none are listed.
  Frames frames_of(const std::string& sensor) const;
};

/// Reads dataset.yaml in a folder. Keys for other programs are ignored.
/// @throws Error naming file, line and rule of each fault.
DatasetListing read_listing(const std::filesystem::path& folder);

/// Returns the text of dataset.yaml. If the file is as the generator writes it, the text ends
/// before the frames, of which there may be any number.
/// @throws Error if it cannot be read.
std::string read_run_text(const std::filesystem::path& folder);

/// Converts seconds to nanoseconds, rounded.
std::chrono::nanoseconds time_of(double time_s);

}  // namespace groundray
