#pragma once

#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>

namespace groundray {

/// Permitted contents of the folder of a run or merge: none, or those of an earlier one of the same
/// scene, seed, version and shard, of which intact files are kept.
enum class FolderUse { New, Resume };

/// Returns true if a folder is empty, or has only remains of a run or merge that was interrupted
/// before it had written anything.
/// @throws std::filesystem::filesystem_error if it cannot be read.
bool is_as_new(const std::filesystem::path& folder);

/// Creates a folder and those that contain it, unless it exists.
/// @throws Error if it cannot be created.
void make_folder(const std::filesystem::path& folder);

/// Messages of work on a folder, for which a program may have a use; none by default.
struct FolderMessages {
  std::FILE* progress = nullptr;  ///< stream on which progress is shown, as by Progress
  std::function<void(const std::string&)> warn = [](const std::string&) {};
};

/// Lock of a folder for one run, or for any number of readers, released by the destructor or when
/// the process ends for any reason. On a network file system, it is only effective among the
/// processes of one machine; on a file system without locks, not at all.
class FolderLock {
 public:
  /// Exclusive or shared use of the folder.
  enum class Use { Write, Read };

  /// Locks the folder; does nothing if it does not exist.
  /// @param warn  called if a lock for writing does not exclude all other runs.
  /// @throws Error if another process has locked it and at least one of the two writes, or if too
  ///         many files are open.
  FolderLock(
      const std::filesystem::path& folder, Use use,
      const std::function<void(const std::string&)>& warn = [](const std::string&) {});
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace groundray
