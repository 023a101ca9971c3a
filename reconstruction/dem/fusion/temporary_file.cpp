#include "reconstruction/dem/fusion/temporary_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

#include "core/error.h"

namespace groundray {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& folder, int fault) {
  const char* const way = fault == ENOSPC   ? "free some space"
                          : fault == EDQUOT ? "raise the quota"
                          : fault == EFBIG  ? "raise the limit on file sizes (ulimit -f)"
                          : fault == ENOENT ? "create the folder first"
                                            : "check that it is writable";
  throw Error(
      "points that do not fit into memory cannot be stored in the folder {}: {}; {}, choose "
      "another folder, or allow more memory",
      folder.string(), std::generic_category().message(fault), way);
}

}  // namespace

TemporaryFile::TemporaryFile(const std::filesystem::path& folder) : folder_(folder) {
  std::string name = (folder / "groundray_points_XXXXXX").string();
  file_ = mkstemp(name.data());
  if (file_ < 0) refuse(folder, errno);
  unlink(name.c_str());
}

TemporaryFile::~TemporaryFile() { close(file_); }

void TemporaryFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) refuse(folder_, done < 0 ? errno : ENOSPC);
    offset += static_cast<std::uint64_t>(done);
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

void TemporaryFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t done = pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      throw Error("points stored in the folder {} cannot be read back: {}; check the disk",
                  folder_.string(),
                  done < 0 ? std::generic_category().message(errno) : "the file is too short");
    }
    offset += static_cast<std::uint64_t>(done);
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

}  // namespace groundray
