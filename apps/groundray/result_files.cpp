#include "apps/groundray/result_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <string>
#include <system_error>

#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

void check_place(const fs::path& path) {
  std::error_code ignored;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored))
    throw Error("{}: there is no folder {} to write it in", path.string(), folder.string());
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    throw Error("{}: cannot be written: it is a folder or a device; choose another name",
                path.string());
  }
  if (access(folder.c_str(), W_OK) != 0)
    throw Error("{}: you may not write in the folder {}", path.string(), folder.string());
}

}  // namespace

void check_ending(const fs::path& path, std::initializer_list<const char*> endings) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (std::ranges::find(endings, ending) == endings.end())
    throw Error("{}: its name must end in {}", path.string(), *endings.begin());
}

void check_results(std::span<const fs::path> results, std::span<const fs::path> inputs) {
  std::vector<fs::path> places;
  for (const fs::path& result : results) {
    check_place(result);
    std::error_code ignored;
    const fs::path place = fs::weakly_canonical(fs::absolute(result), ignored);
    if (std::ranges::find(places, place) != places.end())
      throw Error("{}: two results cannot have one name", result.string());
    places.push_back(place);
    for (const fs::path& input : inputs) {
      if (fs::equivalent(input, result, ignored)) {
        throw Error("{}: it is read, so it cannot be written over; choose another name",
                    result.string());
      }
    }
  }
}

ResultFiles::~ResultFiles() {
  std::error_code ignored;
  for (const auto& [aside, path] : files_) fs::remove(aside, ignored);
}

void ResultFiles::write(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  const std::string other = aside(path).string();
  try {
    write(other);
  } catch (const Error& error) {
    std::string what = error.what();
    for (std::size_t at = 0; (at = what.find(other, at)) != std::string::npos;) {
      what.replace(at, other.size(), path.string());
      at += path.string().size();
    }
    throw Error("{}", what);
  }
}

fs::path ResultFiles::aside(const fs::path& path) {
  for (int number = 0;; ++number) {
    fs::path name = path.stem();
    name += fmt::format(".part-{}-{}", getpid(), number);
    name += path.extension();
    const fs::path aside = path.parent_path() / name;
    const int file = open(aside.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (file < 0 && errno == EEXIST) continue;  // it is somebody else's
    if (file < 0) {
      throw Error("{}: cannot be written: {}", path.string(),
                  std::generic_category().message(errno));
    }
    close(file);
    files_.emplace_back(aside, path);
    return aside;
  }
}

void ResultFiles::appear() {
  for (const auto& [aside, path] : files_) {
    std::error_code fault;
    fs::rename(aside, path, fault);
    if (fault) throw Error("{}: cannot be written: {}", path.string(), fault.message());
  }
  files_.clear();
}

}  // namespace groundray
