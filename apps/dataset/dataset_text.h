#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/file_sum.h"
#include "apps/dataset/frame_entry.h"
#include "apps/dataset/shard.h"

namespace groundray {

/// The name of the file that says what a dataset holds.
inline constexpr std::string_view dataset_file = "dataset.yaml";

/// The file dataset.yaml as the generator writes it (docs/formats.md), read line by line: however
/// many frames it lists, little of it is in memory.
class DatasetText {
 public:
  /// Reads what precedes the frames. @throws Error if the folder has no such file, or it cannot be
  /// read or lists no frames.
  explicit DatasetText(const std::filesystem::path& folder);

  /// What it says of the run: all lines before those of the frames, but not of which shard it is.
  const std::string& header() const noexcept { return header_; }
  /// Nothing if it is of the whole run.
  const std::optional<Shard>& shard() const noexcept { return shard_; }

  /// Returns the text of the entry of the next frame; nothing after the last one. A line that is
  /// none is returned too, for parse_entry to refuse: what was changed hides no frame after it.
  std::optional<std::string> next_entry();
  /// The line that was read last, from 1.
  std::size_t line() const noexcept { return line_; }

  /// After the last frame: the files that are of no frame.
  const std::vector<NamedSum>& files() const noexcept { return files_; }
  /// After the last frame: whether the file is, to the bit, as it was written.
  bool is_intact() const noexcept { return is_intact_; }

 private:
  std::optional<std::string> next_line();
  void read_end(std::string line);

  std::filesystem::path path_;
  std::ifstream file_;
  std::size_t line_ = 0;
  std::string header_;
  std::optional<Shard> shard_;
  std::vector<NamedSum> files_;
  Sha256 sum_;
  bool is_in_frames_ = true, is_intact_ = false;
};

/// Returns in words where one header, or any other text, differs from another first: a short part
/// of a line of each.
std::string first_difference(std::string_view text, std::string_view other);

/// Writes dataset.yaml as a whole file, and waits until it is on the disk.
/// @param next_entry  as of DatasetText. @throws Error as write_whole.
void write_dataset_text(const std::filesystem::path& folder, std::string_view header,
                        const std::optional<Shard>& shard,
                        const std::function<std::optional<std::string>()>& next_entry,
                        const std::vector<NamedSum>& files);

}  // namespace groundray
