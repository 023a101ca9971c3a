#include "core/folder_names.h"

#include <dirent.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <string_view>

namespace groundray {

std::vector<std::string> names_in(const std::filesystem::path& folder, std::error_code& fault) {
  const auto close_folder = [](DIR* open) { closedir(open); };
  const std::unique_ptr<DIR, decltype(close_folder)> open(opendir(folder.c_str()), close_folder);
  std::vector<std::string> names;
  if (open != nullptr) {
    errno = 0;
    while (const dirent* const entry = readdir(open.get())) {
      const std::string_view name = entry->d_name;
      if (name != "." && name != "..") names.emplace_back(name);
      errno = 0;
    }
  }
  fault = {errno, std::generic_category()};
  std::ranges::sort(names);
  return names;
}

}  // namespace groundray
