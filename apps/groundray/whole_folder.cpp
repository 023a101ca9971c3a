#include "apps/groundray/whole_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/print_error.h"

namespace groundray {

namespace fs = std::filesystem;

WholeFolder::WholeFolder(fs::path path) : path_(std::move(path)) {
  if (path_.filename().empty()) path_ = path_.parent_path();
  std::error_code fault;
  const bool exists = fs::exists(path_, fault);
  if (exists && (!fs::is_directory(path_, fault) || !fs::is_empty(path_, fault)))
    throw Error("{}: exists and is not an empty folder; choose another name", path_.string());
  fs::path name = ".";
  name += path_.filename();
  name += fmt::format(".{}.part", getpid());
  const fs::path aside = path_.parent_path() / name;
  if (!fs::create_directory(aside, fault)) {
    throw Error("{}: cannot be made: {}", path_.string(),
                fault ? fault.message() : aside.string() + " exists; remove it");
  }
  aside_ = aside;
}

WholeFolder::~WholeFolder() {
  std::error_code ignored;
  if (!aside_.empty()) fs::remove_all(aside_, ignored);
}

void WholeFolder::appear() {
  std::error_code fault;
  fs::rename(aside_, path_, fault);
  if (fault) throw Error("{}: cannot be written: {}", path_.string(), fault.message());
  aside_.clear();
  print_text(stdout, "written to {}\n", path_.string());
}

}  // namespace groundray
