#include "apps/groundray/result_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"

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
    throw Error("{}: no permission to write in the folder {}", path.string(), folder.string());
}

// Refuses to overwrite a file of a dataset: its record or, in a folder of it, a scan, say.
void refuse_dataset_file(const fs::path& result, const fs::path& place) {
  constexpr int deepest = 3;
  std::error_code ignored;
  if (!fs::exists(place, ignored)) return;
  fs::path folder = place.parent_path();
  const bool is_record = place.filename() == "dataset.yaml";
  for (int depth = 0; depth <= deepest && folder.has_relative_path(); ++depth) {
    if ((depth > 0 || is_record) && fs::exists(folder / "dataset.yaml", ignored)) {
      throw Error("{}: it is a file of the dataset {}; choose another name", result.string(),
                  folder.string());
    }
    folder = folder.parent_path();
  }
}

// Returns a temporary name in the file's folder, with the same extension.
fs::path beside(const fs::path& path, int number) {
  fs::path name = path.stem();
  name += fmt::format(".part-{}-{}", getpid(), number);
  name += path.extension();
  return path.parent_path() / name;
}

// Creates an empty temporary file next to another, under an unused name.
fs::path new_file_beside(const fs::path& path) {
  for (int number = 0;; ++number) {
    fs::path aside = beside(path, number);
    const int file = open(aside.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (file < 0 && errno == EEXIST) continue;  // the name is taken
    if (file < 0) {
      throw Error("{}: cannot be written: {}", path.string(),
                  std::generic_category().message(errno));
    }
    close(file);
    return aside;
  }
}

}  // namespace

void check_results(std::span<const fs::path> results, std::span<const fs::path> inputs) {
  std::vector<fs::path> places;
  for (const fs::path& result : results) {
    check_place(result);
    std::error_code ignored;
    const fs::path place = fs::weakly_canonical(fs::absolute(result), ignored);
    if (std::ranges::find(places, place) != places.end())
      throw Error("{}: two results cannot have the same name", result.string());
    refuse_dataset_file(result, place);
    places.push_back(place);
    for (const fs::path& input : inputs) {
      if (fs::equivalent(input, result, ignored)) {
        throw Error("{}: it is an input and cannot be overwritten; choose another name",
                    result.string());
      }
    }
  }
}

ResultFiles::~ResultFiles() {
  std::error_code ignored;
  for (const File& file : files_) {
    fs::remove(file.aside, ignored);
    if (!file.spare.empty()) fs::remove(file.spare, ignored);
  }
}

void ResultFiles::write(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  files_.push_back({.path = path, .aside = {}, .spare = {}});
  files_.back().aside = new_file_beside(path);  // after push_back, which may throw
  const std::string other = files_.back().aside.string();
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

void ResultFiles::appear() {
  for (File& file : files_) spare(file);
  const std::string done = printable(fmt::format("written to {}\n", files_.back().path.string()));
  for (std::size_t i = 0; i < files_.size(); ++i) {
    const File& file = files_[i];
    std::error_code fault;
    fs::rename(file.aside, file.path, fault);
    if (fault) {
      throw Error("{}: cannot be written: {}{}", file.path.string(), fault.message(), take_back(i));
    }
  }
  std::error_code ignored;
  for (const File& file : files_)
    if (!file.spare.empty()) fs::remove(file.spare, ignored);
  files_.clear();
  std::fputs(done.c_str(), stdout);
}

// Gives an existing file at the path a second name.
void ResultFiles::spare(File& file) const {
  std::error_code fault;
  file.is_new = !fs::exists(fs::symlink_status(file.path, fault));
  if (file.is_new) return;
  for (int number = 0;; ++number) {
    const fs::path name = beside(file.path, number);
    fs::create_hard_link(file.path, name, fault);
    if (fault == std::errc::file_exists) continue;
    if (!fault) file.spare = name;
    return;
  }
}

// Restores the first `count` paths; returns a description of those that could not be restored. A
// spare that cannot be renamed back is the only copy of the user's file, and so it is kept.
std::string ResultFiles::take_back(std::size_t count) {
  std::string left;
  for (std::size_t i = 0; i < count; ++i) {
    File& file = files_[i];
    std::error_code fault;
    if (!file.spare.empty()) {
      fs::rename(file.spare, file.path, fault);
    } else if (file.is_new) {
      fs::remove(file.path, fault);
    }
    const bool is_left = fault || (file.spare.empty() && !file.is_new);
    if (!is_left) continue;
    left += fmt::format("; {} is written nevertheless", file.path.string());
    if (file.spare.empty()) continue;
    left += fmt::format(", and its previous version is kept as {}", file.spare.string());
    file.spare.clear();
  }
  return left;
}

}  // namespace groundray
