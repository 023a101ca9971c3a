#include "apps/groundray/run/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "core/error.h"

namespace groundray {

FolderLock::FolderLock(const std::filesystem::path& folder, Use use)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  const int kind = use == Use::Write ? LOCK_EX : LOCK_SH;
  if (descriptor_ < 0 || flock(descriptor_, kind | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(descriptor_);
  throw Error("{}: another run is at work in this folder: wait until it ends, or choose another",
              folder.string());
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace groundray
