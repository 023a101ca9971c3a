#pragma once

#include <filesystem>

namespace groundray {

/// Keeps a folder for one run, or for those that only read it, while it lives. A process that ends,
/// however it does, gives it free. File systems without locks are taken at their users' word.
class FolderLock {
 public:
  enum class Use { Write, Read };

  /// @throws Error if another process has the folder for another use, or writes into it as well.
  FolderLock(const std::filesystem::path& folder, Use use);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace groundray
