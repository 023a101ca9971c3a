#pragma once

#include <filesystem>
#include <vector>

namespace groundray {

/// Recently opened files, stored between runs of the program.
class RecentFiles {
 public:
  /// @param file  file that stores them. If it cannot be read or written, or is empty, they are
  ///              lost with this object.
  explicit RecentFiles(std::filesystem::path file);

  /// Returns the paths, most recent first, `most_files` at most.
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
