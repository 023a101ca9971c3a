#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace groundray {

/// The name of the journal in a dataset: it is there while a run is at work, or was cut off.
inline constexpr std::string_view journal_file = "dataset.journal";

/// What a run has done so far, a line for each frame: the begin of the SHA-256 of an entry of
/// dataset.yaml, a blank, and the entry. Lines are only ever added. A process that is killed loses
/// none of them; a computer that loses its power, those of the last seconds.
class Journal {
 public:
  /// Begins one anew. @throws Error if it cannot be written.
  explicit Journal(std::filesystem::path path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Returns where the entry is found again. @throws Error if it cannot be written.
  std::uint64_t add(std::string_view entry);
  /// Returns the entry at a place that add returned. @throws Error if it cannot be read.
  std::string at(std::uint64_t place) const;

  /// Takes the place of another file. @throws Error if it cannot.
  void rename_to(const std::filesystem::path& path);
  /// Takes it off the disk.
  void remove() noexcept;

 private:
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_bytes_ = 0;
  std::chrono::steady_clock::time_point synced_;
};

/// Reads what a journal holds, in its order. Lines that were torn or changed are left out.
/// @return how many those were. @throws Error if the file cannot be read.
std::size_t read_journal(const std::filesystem::path& path,
                         const std::function<void(const std::string& entry)>& take);

}  // namespace groundray
