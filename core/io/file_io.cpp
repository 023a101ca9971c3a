#include "core/io/file_io.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/memory.h"
#include "core/io/open_file.h"

namespace groundray {
namespace {

[[noreturn]] void throw_system_error() { throw std::system_error(errno, std::generic_category()); }

std::string_view way_to_write(const std::error_code& fault) {
  if (fault == std::errc::no_space_on_device) return "free some space or write to another disk";
  if (fault == std::errc::file_too_large) return "raise the limit on file sizes (ulimit -f)";
  if (fault == std::errc::no_such_file_or_directory) return "create its folder first";
  if (fault == std::errc::not_a_directory) return "a part of its path is a file: choose another";
  if (fault == std::errc::filename_too_long) return "choose a shorter name";
  if (fault == std::errc::too_many_files_open) return "raise the limit on open files (ulimit -n)";
  if (fault == std::errc::permission_denied || fault == std::errc::operation_not_permitted ||
      fault == std::errc::read_only_file_system) {
    return "choose a folder with write permission";
  }
  return "check the path, the disk and its quota";
}

}  // namespace

void write_whole(const std::filesystem::path& path,
                 const std::function<void(const std::filesystem::path&)>& write) {
  std::error_code ignored;
  const std::filesystem::file_status before = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(before) && !std::filesystem::is_regular_file(before)) {
    throw Error("{}: cannot be written: it is a folder or a device; choose another name",
                path.string());
  }
  std::filesystem::path aside = path;
  aside += ".part";
  try {
    close(create_file(aside));
    write(aside);
    std::filesystem::rename(aside, path);
  } catch (const std::system_error& fault) {
    std::filesystem::remove(aside, ignored);
    throw Error("{}: cannot be written: {}; {}", path.string(), fault.code().message(),
                way_to_write(fault.code()));
  } catch (...) {
    std::filesystem::remove(aside, ignored);
    throw;
  }
}

void write_blocks(const std::filesystem::path& path,
                  const std::function<std::string_view()>& next_block) {
  write_whole(path, [&](const std::filesystem::path& aside) {
    OwnedFile file(fdopen(create_file(aside), "wb"));
    std::setvbuf(file.get(), nullptr, _IONBF, 0);
    for (std::string_view block = next_block(); !block.empty(); block = next_block()) {
      if (std::fwrite(block.data(), 1, block.size(), file.get()) != block.size())
        throw_system_error();
    }
    if (std::fclose(file.release()) != 0) throw_system_error();
  });
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  write_blocks(path, [&text] { return std::exchange(text, {}); });
}

std::string read_text(const std::filesystem::path& path) {
  const OwnedFile file = open_file(path);
  struct stat status {};
  fstat(fileno(file.get()), &status);
  const auto bytes = static_cast<std::size_t>(status.st_size);
  require_memory(path.string(), "its bytes", static_cast<double>(bytes));
  std::string text;
  std::size_t size = 0;
  // One byte more than the file has shows its end. Some files of the system declare no size.
  for (std::size_t room = bytes + 1; std::feof(file.get()) == 0 && std::ferror(file.get()) == 0;
       room = std::max<std::size_t>(2 * size, 1 << 16)) {
    text.resize(room);
    size += std::fread(text.data() + size, 1, text.size() - size, file.get());
  }
  if (std::ferror(file.get()) != 0) {
    throw Error("{}: cannot be read: {}; check its name and permissions", path.string(),
                std::generic_category().message(errno));
  }
  text.resize(size);
  return text;
}

std::string file_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

void check_ending(const std::filesystem::path& path, std::initializer_list<const char*> endings) {
  if (std::ranges::find(endings, file_ending(path)) == endings.end())
    throw Error("{}: its name must end in {}", path.string(), *endings.begin());
}

}  // namespace groundray
