#pragma once

#include <filesystem>

namespace groundray {

/// Keeps a folder for one run, or for those that only read it, while it lives. A process that ends,
/// however it does, gives it free. On a file system of a network it keeps the processes of one
/// machine apart, on one without locks none: who writes there is warned on standard error.
class FolderLock {
 public:
  enum class Use { Write, Read };

  /// @throws Error if another process has the folder for another use, or writes into it as well, or
  /// if too many files are open. A folder that is not there is nobody's.
  FolderLock(const std::filesystem::path& folder, Use use);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace groundray
