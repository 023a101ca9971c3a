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
#include "apps/dataset/run_part.h"

namespace groundray {

/// Name of the file that lists a dataset's contents.
inline constexpr std::string_view dataset_file = "dataset.yaml";

/// Reader of dataset.yaml in the form that the generator writes (docs/reference/formats.md). It
/// reads line by line, so that memory does not grow with the number of frames.
class DatasetText {
 public:
  /// Reads the part before the frames.
  /// @throws Error if the folder has no such file, or it cannot be read or lists no frames.
  explicit DatasetText(const std::filesystem::path& folder);

  /// Description of the run: all lines before the frames, except those of the shard and of the
  /// choice.
  const std::string& header() const noexcept { return header_; }
  /// Shard of the run; nothing for a whole run.
  const std::optional<Shard>& shard() const noexcept { return part_.shard; }
  /// Choice of sensors and frames; all by default.
  const FrameChoice& choice() const noexcept { return part_.choice; }

  /// Returns the text of the next frame's entry; nothing after the last. Lines that are not entries
  /// are returned as well, and rejected by parse_entry, so that an altered line does not hide the
  /// frames after it.
  std::optional<std::string> next_entry();
  /// Number of the line that was read last, from 1.
  std::size_t line() const noexcept { return line_; }

  /// Files that belong to no frame; valid after the last frame.
  const std::vector<NamedSum>& files() const noexcept { return files_; }
  /// True if the file is exactly as it was written; valid after the last frame.
  bool is_intact() const noexcept { return is_intact_; }

 private:
  bool read_part(std::string_view line);
  std::optional<std::string> next_line();
  void read_end(std::string line);

  std::filesystem::path path_;
  std::ifstream file_;
  std::size_t line_ = 0;
  std::string header_;
  RunPart part_;
  std::vector<NamedSum> files_;
  Sha256 sum_;
  bool is_in_frames_ = true, is_intact_ = false;
};

/// Returns a message with the first difference between two texts: a short part of the line of each.
std::string first_difference(std::string_view text, std::string_view other);

/// Writes dataset.yaml by write_whole, and waits until it is on the disk.
/// @param next_entry  returns entries as DatasetText::next_entry.
/// @throws Error as write_whole.
void write_dataset_text(const std::filesystem::path& folder, std::string_view header,
                        const RunPart& part,
                        const std::function<std::optional<std::string>()>& next_entry,
                        const std::vector<NamedSum>& files);

}  // namespace groundray
