#include "apps/groundray/run/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <string>
#include <system_error>

#include "core/error.h"

namespace groundray {
namespace {

// Returns true on network file systems, most of which lock folders only within one machine.
bool is_on_network(int folder) {
  constexpr std::uint32_t smb2 = 0xFE534D42, lustre = 0x0BD00BD0, gpfs = 0x47504653;
  constexpr std::array<std::uint32_t, 6> networks{
      NFS_SUPER_MAGIC, SMB_SUPER_MAGIC, CIFS_SUPER_MAGIC, smb2, lustre, gpfs};
  struct statfs system {};
  if (fstatfs(folder, &system) != 0) return false;
  return std::ranges::find(networks, static_cast<std::uint32_t>(system.f_type)) != networks.end();
}

void warn(const std::filesystem::path& folder, const std::string& why) {
  fmt::print(stderr, "{}: warning: {}: make sure that no other run uses this folder\n",
             folder.string(), why);
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder, Use use)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    if (errno != EMFILE && errno != ENFILE) return;
    throw Error("{}: cannot be opened: {}; `ulimit -n` allows more", folder.string(),
                std::generic_category().message(errno));
  }
  const int kind = use == Use::Write ? LOCK_EX : LOCK_SH;
  if (flock(descriptor_, kind | LOCK_NB) == 0) {
    if (use == Use::Write && is_on_network(descriptor_))
      warn(folder, "locks on a network file system exclude only runs of this machine");
    return;
  }
  if (errno == EWOULDBLOCK) {
    close(descriptor_);
    throw Error("{}: another run is using this folder: wait until it ends, or choose another",
                folder.string());
  }
  if (use == Use::Write) {
    warn(folder,
         fmt::format("the file system has no locks ({})", std::generic_category().message(errno)));
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace groundray
