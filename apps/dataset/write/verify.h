#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/dataset_reader.h"
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

/// Result of checking a dataset.
struct Verification {
  std::size_t files = 0, faults = 0;    ///< numbers of checked files and of faults
  std::uint64_t bytes = 0;              ///< size of these files
  std::size_t done = 0, asked_for = 0;  ///< numbers of finished frames, and of all

  /// Returns true if frames are missing, and nothing else is wrong.
  bool is_unfinished() const { return faults == 1 && done < asked_for; }
};

/// Reads every file of a dataset and compares it with its entry in dataset.yaml. Missing frames of
/// a dataset or shard, and files that do not belong to it, are faults as well.
/// @param report    called with a description of each fault as soon as it is found.
/// @param progress  stream on which progress is shown, as by Progress; null for none.
/// @throws Error if dataset.yaml cannot be read, or a run uses the folder; Interrupted.
Verification verify(const std::filesystem::path& dataset,
                    const std::function<void(const std::string&)>& report,
                    std::FILE* progress = nullptr);

}  // namespace groundray
