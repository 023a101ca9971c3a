#include "core/io/open_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "core/error.h"
#include "core/near_names.h"

namespace groundray {
namespace {

// Opens a regular file, or returns nothing and sets errno: EISDIR for a folder, ESPIPE for a pipe,
// socket or device.
OwnedFile try_to_open(const std::filesystem::path& path) {
  // A pipe is opened without waiting for a writer.
  const int descriptor = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) return {};
  struct stat status {};
  OwnedFile file;
  int fault = ESPIPE;
  if (fstat(descriptor, &status) != 0) {
    fault = errno;
  } else if (S_ISDIR(status.st_mode)) {
    fault = EISDIR;
  } else if (S_ISREG(status.st_mode)) {
    file.reset(fdopen(descriptor, "rb"));
    if (file) return file;
    fault = errno;
  }
  close(descriptor);
  errno = fault;
  return file;
}

}  // namespace

int create_file(const std::filesystem::path& path) {
  struct stat before {};
  const bool exists = lstat(path.c_str(), &before) == 0;
  if (exists && !S_ISREG(before.st_mode) && !S_ISLNK(before.st_mode))
    throw std::system_error(EEXIST, std::generic_category());
  if (exists && unlink(path.c_str()) != 0) throw std::system_error(errno, std::generic_category());
  const int descriptor =
      open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category());
  return descriptor;
}

OwnedFile open_file(const std::filesystem::path& path) {
  OwnedFile file = try_to_open(path);
  if (file) return file;
  throw Error("{}: {}", path.string(), why_not_read(path, errno));
}

std::string why_not_read(const std::filesystem::path& path, int fault) {
  if (fault == ENOENT || fault == ENOTDIR || fault == EISDIR) return why_no_file(path);
  if (fault == ESPIPE) return "it is a pipe or device, but must be a file";
  return fmt::format("it cannot be read: {}; check its permissions",
                     std::generic_category().message(fault));
}

std::ifstream open_stream(const std::filesystem::path& path) {
  std::ifstream stream;
  const OwnedFile file = try_to_open(path);
  const int fault = errno;
  // By its descriptor, so that the file is the one that was checked.
  if (file) stream.open(fmt::format("/proc/self/fd/{}", fileno(file.get())), std::ios::binary);
  if (!file) stream.setstate(std::ios::failbit);
  errno = file ? 0 : fault;
  return stream;
}

bool next_line(std::istream& file, std::string& line) {
  constexpr std::size_t most_bytes = 1 << 26;
  line.clear();
  if (!file) return false;
  for (int c = file.rdbuf()->sbumpc(); c != '\n'; c = file.rdbuf()->sbumpc()) {
    if (c == std::char_traits<char>::eof() || line.size() == most_bytes) {
      const bool is_last = c == std::char_traits<char>::eof() && !line.empty();
      file.setstate(is_last ? std::ios::eofbit : std::ios::eofbit | std::ios::failbit);
      return is_last;
    }
    line += static_cast<char>(c);
  }
  return true;
}

}  // namespace groundray
