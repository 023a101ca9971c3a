#pragma once

#include <filesystem>

namespace groundray {

/// Folder for temporary files, which disappears with the object.
class TemporaryFolder {
 public:
  /// @throws Error if it cannot be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace groundray
