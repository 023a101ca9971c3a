#include "core/own_folder.h"

#include <dlfcn.h>

#include <system_error>

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Returns the folder of the shared library that contains this code; empty if a program does.
fs::path module_folder() {
  Dl_info info{};
  static const char here = 0;
  if (dladdr(&here, &info) == 0 || info.dli_fname == nullptr) return {};
  std::error_code ignored;
  const fs::path file = info.dli_fname;  // of a program, it is the name that it was started by
  if (!file.is_absolute() || fs::equivalent(file, "/proc/self/exe", ignored)) return {};
  return file.parent_path();
}

}  // namespace

fs::path own_folder() {
  std::error_code ignored;
  const auto has_data = [&](const fs::path& folder) {
    return fs::exists(folder / "data/sensors", ignored);
  };
  // A wheel has the module as groundray/_core*.so, and the programs in groundray/bin.
  fs::path beside_module = module_folder();
  if (!beside_module.empty()) return has_data(beside_module) ? beside_module : source_folder();
  fs::path prefix = fs::read_symlink("/proc/self/exe", ignored).parent_path().parent_path();
  if (fs::exists(prefix / "__init__.py", ignored) && has_data(prefix)) return prefix;
  const fs::path shared = prefix / "share/groundray";
  return has_data(shared) ? shared : source_folder();
}

}  // namespace groundray
