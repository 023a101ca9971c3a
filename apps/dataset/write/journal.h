#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "apps/dataset/dataset_reader.h"

namespace groundray {

/// Name of the journal in a dataset: it exists while a run is active, or after an interruption.
inline constexpr std::string_view journal_file = "dataset.journal";

/// Record of a run's progress, one line per frame: the first digits of the SHA-256 of an entry of
/// dataset.yaml, a blank, and the entry. Lines are only appended. If the process is killed, no line
/// is lost; if the computer loses power, those of the last seconds are.
class Journal {
 public:
  /// Creates the file, replacing an existing one.
  /// @throws Error if it cannot be written.
  explicit Journal(std::filesystem::path path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Appends an entry and returns its position.
  /// @throws Error if it cannot be written.
  std::uint64_t add(std::string_view entry);
  /// Returns the entry at a position that add() returned.
  /// @throws Error if it cannot be read.
  std::string at(std::uint64_t place) const;

  /// Renames the file, replacing an existing one.
  /// @throws Error if it cannot be renamed.
  void rename_to(const std::filesystem::path& path);
  /// Deletes the file.
  void remove() noexcept;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_bytes_ = 0;
  std::chrono::steady_clock::time_point synced_;
};

/// Reads the entries of a journal in their order. Torn or altered lines are omitted.
/// @return number of omitted lines.
/// @throws Error if the file cannot be read.
std::size_t read_journal(const std::filesystem::path& path,
                         const std::function<void(const std::string& entry)>& take);

/// Replaces the numbers of finished frames by those of a journal: dataset.yaml is updated only when
/// a run ends.
/// @throws Error if the file cannot be read.
void count_journal(const std::filesystem::path& path, DatasetSummary& dataset);

}  // namespace groundray
