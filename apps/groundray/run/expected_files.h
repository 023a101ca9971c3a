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

/// The files that a dataset should have: what of others is a stranger. Frames that follow each
/// other with files of the same kinds take one place together, so that it is small however many
/// there are.
class ExpectedFiles {
 public:
  /// @param dataset  is to outlive this.
  explicit ExpectedFiles(const DatasetSummary& dataset);

  /// Adds the files of a frame that is done. Frames of a sensor come in their order.
  /// @return false if they do not, or it is not of the run: it is then left out.
  bool add(const FrameEntry& frame);
  /// Adds a file that is of no frame.
  void add(const NamedSum& file);

  /// Returns in words why a file is not expected; nothing if it is.
  /// @param path  in the dataset, with slashes.
  std::optional<std::string> fault_of(std::string_view path) const;
  /// Whether files are expected in a folder, or in one within.
  bool has_folder(const std::string& path) const { return folders_.contains(path); }

 private:
  using Suffixes = std::set<std::string, std::less<>>;
  struct Run {
    std::int64_t begin = 0, end = 0;  // frames
    const Suffixes* suffixes = nullptr;
  };

  void add_folders(const std::string& path);

  const DatasetSummary& dataset_;
  std::set<Suffixes> kinds_;            // that occur
  std::vector<std::vector<Run>> runs_;  // by sensor; by number
  std::set<std::string, std::less<>> files_, folders_;
};

}  // namespace groundray
