#pragma once

#include <filesystem>

namespace groundray {

/// Lock of a folder for one run, or for any number of readers, released by the destructor or when
/// the process ends for any reason. On a network file system, it is only effective among the
/// processes of one machine; on a file system without locks, not at all. In both cases, a writer
/// gets a warning on standard error.
class FolderLock {
 public:
  enum class Use { Write, Read };

  /// Locks the folder; does nothing if it does not exist.
  /// @throws Error if another process has locked it and at least one of the two writes, or if too
  ///         many files are open.
  FolderLock(const std::filesystem::path& folder, Use use);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace groundray
