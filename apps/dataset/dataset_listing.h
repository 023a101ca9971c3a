#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh_io.h"

namespace groundray {

/// What the names of scans end with.
inline constexpr std::string_view scan_suffix = ".ply";

/// A scan or an image that is there.
struct RecordedFrame {
  std::int64_t number = 0;
  std::chrono::nanoseconds stamp{0};
  std::filesystem::path file;
};

/// What the file dataset.yaml of a dataset lists (docs/formats.md).
struct DatasetListing {
  struct Pair {
    std::string name, left, right;  ///< of the pair, and of its cameras
  };
  struct Frames {
    std::vector<RecordedFrame> done;  ///< by number; the reader of their sensor names the files
    std::size_t pending = 0;          ///< that are not there yet
  };

  Georeference georeference;
  std::vector<std::string> lidars, cameras;
  std::vector<Pair> pairs;
  std::map<std::string, Frames> frames;  ///< by sensor

  /// Returns the frames of a sensor, none if none is listed.
  Frames frames_of(const std::string& sensor) const;
};

/// Reads dataset.yaml in a folder. What concerns other programs is left alone.
/// @throws Error naming file, line and rule of each fault.
DatasetListing read_listing(const std::filesystem::path& folder);

/// Returns the text of dataset.yaml; where it is as the generator writes it, without the frames, of
/// which there may be any number. @throws Error if it cannot be read.
std::string read_run_text(const std::filesystem::path& folder);

/// Returns a time in nanoseconds.
std::chrono::nanoseconds time_of(double time_s);

}  // namespace groundray
