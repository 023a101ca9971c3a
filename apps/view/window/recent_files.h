#pragma once

#include <filesystem>
#include <vector>

namespace groundray {

/// What was opened last, kept in a file from one start of the program to the next.
class RecentFiles {
 public:
  /// @param file  where they are kept; if it cannot be read or written, they are kept no longer
  ///              than this. Empty for none.
  explicit RecentFiles(std::filesystem::path file);

  /// Returns them, the last first: most_files at most.
  const std::vector<std::filesystem::path>& paths() const noexcept { return paths_; }
  void add(const std::filesystem::path& path);
  void clear();

  static constexpr std::size_t most_files = 10;

 private:
  void keep() const;

  std::filesystem::path file_;
  std::vector<std::filesystem::path> paths_;
};

}  // namespace groundray
