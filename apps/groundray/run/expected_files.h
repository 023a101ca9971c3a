#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/dataset_summary.h"
#include "apps/dataset/frame_entry.h"

namespace groundray {

/// Set of the files that belong to a dataset; all others are reported. Consecutive frames with the
/// same suffixes are stored as one run, so that the set stays small for any number of frames.
class ExpectedFiles {
 public:
  /// @param dataset  must outlive this.
  explicit ExpectedFiles(const DatasetSummary& dataset);

  /// Adds the files of a finished frame. Frames of a sensor must be added in ascending order.
  /// @return false if they are not, or the frame is not of the run; it is then ignored.
  bool add(const FrameEntry& frame);
  /// Adds a file that belongs to no frame.
  void add(const NamedSum& file);

  /// Returns a description of why a file is not expected; nothing if it is.
  /// @param path  relative to the dataset, with slashes.
  std::optional<std::string> fault_of(std::string_view path) const;
  /// Returns true if files are expected in a folder, or in one of its subfolders.
  bool has_folder(const std::string& path) const { return folders_.contains(path); }

 private:
  using Suffixes = std::set<std::string, std::less<>>;
  struct Run {
    std::int64_t begin = 0, end = 0;  // range of frame numbers
    const Suffixes* suffixes = nullptr;
  };

  void add_folders(const std::string& path);

  const DatasetSummary& dataset_;
  std::set<Suffixes> kinds_;            // all that occur
  std::vector<std::vector<Run>> runs_;  // by sensor; sorted by frame number
  std::set<std::string, std::less<>> files_, folders_;
};

}  // namespace groundray
