#pragma once

#include <filesystem>

namespace groundray {

/// Folder that appears with all its files, or not at all: it is filled under a temporary name
/// beside its own. The destructor removes what has not appeared.
class WholeFolder {
 public:
  /// @throws Error if there is a file of this name, or a folder that is not empty; or if it cannot
  ///         be made.
  explicit WholeFolder(std::filesystem::path path);
  ~WholeFolder();
  WholeFolder(const WholeFolder&) = delete;
  WholeFolder& operator=(const WholeFolder&) = delete;

  /// Returns the path of a file in the folder until it appears.
  std::filesystem::path file(const std::filesystem::path& name) const { return aside_ / name; }
  /// Renames the folder to its path, and prints that it is written.
  /// @throws Error if it cannot be renamed.
  void appear();

 private:
  std::filesystem::path path_, aside_;
};

}  // namespace groundray
