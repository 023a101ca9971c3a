#include "apps/dataset/write/dataset_folder.h"

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
#include <system_error>

#include "apps/dataset/dataset_text.h"
#include "core/error.h"
#include "core/folder_names.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Returns true on network file systems, most of which lock folders only within one machine.
bool is_on_network(int folder) {
  constexpr std::uint32_t smb2 = 0xFE534D42, lustre = 0x0BD00BD0, gpfs = 0x47504653;
  constexpr std::array<std::uint32_t, 6> networks{
      NFS_SUPER_MAGIC, SMB_SUPER_MAGIC, CIFS_SUPER_MAGIC, smb2, lustre, gpfs};
  struct statfs system {};
  if (fstatfs(folder, &system) != 0) return false;
  return std::ranges::find(networks, static_cast<std::uint32_t>(system.f_type)) != networks.end();
}

std::string warning(const fs::path& folder, const std::string& why) {
  return fmt::format("{}: warning: {}: make sure that no other run uses this folder",
                     folder.string(), why);
}

}  // namespace

bool is_as_new(const fs::path& folder) {
  std::error_code fault;
  const auto names = names_in(folder, fault);
  if (fault) throw Error("{}: the folder cannot be read: {}", folder.string(), fault.message());
  return std::ranges::all_of(
      names, [](const auto& name) { return name == fmt::format("{}.part", dataset_file); });
}

void make_folder(const fs::path& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) {
    throw Error("{}: cannot create this folder: {}; choose another one with -o", folder.string(),
                failure.message());
  }
}

FolderLock::FolderLock(const fs::path& folder, Use use,
                       const std::function<void(const std::string&)>& warn)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    if (errno != EMFILE && errno != ENFILE) return;
    throw Error("{}: cannot be opened: {}; `ulimit -n` allows more", folder.string(),
                std::generic_category().message(errno));
  }
  const int kind = use == Use::Write ? LOCK_EX : LOCK_SH;
  if (flock(descriptor_, kind | LOCK_NB) == 0) {
    if (use == Use::Write && is_on_network(descriptor_))
      warn(warning(folder, "locks on a network file system exclude only runs of this machine"));
    return;
  }
  if (errno == EWOULDBLOCK) {
    close(descriptor_);
    throw Error("{}: another run is using this folder: wait until it ends, or choose another",
                folder.string());
  }
  if (use == Use::Write) {
    warn(warning(folder, fmt::format("the file system has no locks ({})",
                                     std::generic_category().message(errno))));
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace groundray
